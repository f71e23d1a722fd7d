// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/vertex_groups.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "runtime/skin/group_cells.hpp"

namespace ecorche::runtime {
namespace {

constexpr std::size_t kGroupSize = VertexGroups::size;
constexpr float kNarrowed = 2e-4F;  // mm that narrowing may move a vertex at rest
constexpr double kLocalEnough =
    2.5;  // nodes of groups in the own order over those in Morton's, where it is kept

using Order = std::vector<std::uint32_t>;

// Every third bit of 64 from the lowest 21.
std::uint64_t spread(std::uint64_t v) {
  v = (v | v << 32) & 0x1f00000000ffffU;
  v = (v | v << 16) & 0x1f0000ff0000ffU;
  v = (v | v << 8) & 0x100f00f00f00f00fU;
  v = (v | v << 4) & 0x10c30c30c30c30c3U;
  return (v | v << 2) & 0x1249249249249249U;
}

// Of equal ones the lower comes first. By digits, the lowest first: codes are few bits longer than their
// number.
Order order_by(const std::vector<std::uint64_t>& code) {
  constexpr std::uint64_t digits = 2048;
  Order order(code.size()), other(code.size());
  std::iota(order.begin(), order.end(), 0U);
  const std::uint64_t highest = code.empty() ? 0 : *std::max_element(code.begin(), code.end());
  for (unsigned shift = 0; shift < 64 && highest >> shift != 0; shift += 11) {
    std::array<std::uint32_t, digits + 1> next{};
    for (const std::uint64_t c : code) ++next[(c >> shift) % digits + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    for (const std::uint32_t i : order) other[next[(code[i] >> shift) % digits]++] = i;
    order.swap(other);
  }
  return order;
}

// Places of 1/8 mm from the lowest corner: enough to order vertices by, and never beyond 21 bits.
Order morton_order(const PointsF& V) {
  const Eigen::RowVector3f low = V.colwise().minCoeff();
  std::vector<std::uint64_t> code(static_cast<std::size_t>(V.rows()));
  for (std::size_t v = 0; v < code.size(); ++v) {
    const Eigen::RowVector3f at = (V.row(static_cast<Eigen::Index>(v)) - low) * 8;
    for (int c = 0; c < 3; ++c) {
      code[v] |= spread(static_cast<std::uint64_t>(std::clamp(at[c], 0.0F, 2e6F))) << c;
    }
  }
  return order_by(code);
}

// The 16 vertices of a group, fewer in the last.
std::span<const std::uint32_t> vertices_of(const Order& order, std::size_t group) {
  return std::span(order).subspan(kGroupSize * group,
                                  std::min(kGroupSize, order.size() - kGroupSize * group));
}

// By their places in `hold`. A stamp of its group in place of a branch: half of the corners are new.
GroupNodes nodes_of(const Order& order, const TissueNodes& hold) {
  GroupNodes out;
  const std::size_t groups = (order.size() + kGroupSize - 1) / kGroupSize;
  out.begin.reserve(groups + 1);
  out.node.reserve(4 * order.size());
  std::vector<std::uint32_t> last(hold.nodes.size());
  for (std::uint32_t g = 0; g < groups; ++g) {
    std::array<std::uint32_t, 4 * kGroupSize> found;
    std::size_t count = 0;
    for (const std::uint32_t v : vertices_of(order, g)) {
      for (const std::uint32_t node : hold.corners[v]) {
        found[count] = node;
        count += static_cast<std::size_t>(last[node] != g + 1);
        last[node] = g + 1;
      }
    }
    out.node.insert(out.node.end(), found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count));
    out.begin.push_back(static_cast<std::uint32_t>(out.node.size()));
  }
  return out;
}

// The groups of each cell, cells sorted by the slab of the last of their nodes.
std::vector<std::span<const std::uint32_t>> by_last_slab(const GroupCells& cells, const GroupNodes& nodes,
                                                         const std::vector<std::uint32_t>& lane) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> slab_and_cell;
  slab_and_cell.reserve(cells.end.size());
  for (std::uint32_t c = 0, g = 0; c < cells.end.size(); ++c) {
    std::uint32_t last = 0;
    for (; g < cells.end[c]; ++g) {
      for (const std::uint32_t node : nodes.of(cells.group[g])) last = std::max(last, lane[node]);
    }
    slab_and_cell.emplace_back(static_cast<std::uint32_t>(last / NodeClusters::slab), c);
  }
  std::sort(slab_and_cell.begin(), slab_and_cell.end());
  std::vector<std::span<const std::uint32_t>> out;
  out.reserve(slab_and_cell.size());
  for (const auto& [slab, c] : slab_and_cell) {
    const std::uint32_t first = c == 0 ? 0 : cells.end[c - 1];
    out.push_back(std::span(cells.group).subspan(first, cells.end[c] - first));
  }
  return out;
}

// A number a vertex of a group: loops over them become vectors.
using Lanes = std::array<float, kGroupSize>;

// As std::lround of what is no larger than 65536, which here is a call into a library: what is taken away is
// exact.
int rounded(float value) {
  const int whole = static_cast<int>(value);
  const float left = value - static_cast<float>(whole);
  return whole + static_cast<int>(left >= 0.5F) - static_cast<int>(left <= -0.5F);
}

// What a group's vertices have at rest; where there are fewer than 16 the last one fills up.
struct AtRest {
  std::array<Lanes, 3> barycentric;          // of corners 1, 2, 3
  std::array<std::array<Lanes, 3>, 3> edge;  // of the tet, from corner 0 to 1, 2, 3
  std::array<Lanes, 3> normal;

  Eigen::Matrix3f edges(std::size_t i) const {
    Eigen::Matrix3f out;
    for (std::size_t c = 0; c < 3; ++c)
      out.col(static_cast<Eigen::Index>(c)) << edge[c][0][i], edge[c][1][i], edge[c][2][i];
    return out;
  }
  // The largest sum of a tet's three edges.
  float reach() const {
    float out = 0;
    for (std::size_t i = 0; i < kGroupSize; ++i) out = std::max(out, edges(i).colwise().norm().sum());
    return out;
  }
  // No less than `reach`, with one root: a sum of three is largest where they are equal.
  float far_reach() const {
    Lanes squares{};
    for (const std::array<Lanes, 3>& e : edge) {
      for (const Lanes& x : e)
        for (std::size_t i = 0; i < kGroupSize; ++i) squares[i] += x[i] * x[i];
    }
    return 1.0001F * std::sqrt(3 * *std::max_element(squares.begin(), squares.end()));
  }
  // As normal_shares.
  std::array<Lanes, 3> shares() const {
    std::array<Lanes, 3> out;
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < kGroupSize; ++i)
        out[c][i] =
            edge[c][0][i] * normal[0][i] + (edge[c][1][i] * normal[1][i] + edge[c][2][i] * normal[2][i]);
    }
    Lanes most;
    for (std::size_t i = 0; i < kGroupSize; ++i) {
      most[i] = std::max(std::max(std::abs(out[0][i]), std::abs(out[1][i])), std::abs(out[2][i]));
      most[i] = most[i] > 0 ? most[i] : std::numeric_limits<float>::infinity();
    }
    for (Lanes& share : out)
      for (std::size_t i = 0; i < kGroupSize; ++i) share[i] /= most[i];
    return out;
  }
};

// Corners 1 to 3 of a tet turned so that the first share of the normal is the largest and positive, and the
// others over it (VertexGroups::normal). To exchange two corners is to change the sign of every cross
// product.
struct Turned {
  std::array<std::uint8_t, 3> corner{0, 1, 2};  // less one
  std::int16_t second = VertexGroups::no_normal, third = 0;
};

Turned turn(const std::array<Lanes, 3>& shares, std::size_t i) {
  const std::array<float, 3> size{std::abs(shares[0][i]), std::abs(shares[1][i]), std::abs(shares[2][i])};
  std::size_t first = size[1] > size[0] ? 1 : 0;
  first = size[2] > size[first] ? 2 : first;
  if (size[first] != 1) return {};  // all are zero, or no numbers
  constexpr std::array<std::uint8_t, 5> around{0, 1, 2, 0, 1};
  const bool turned = shares[first][i] < 0;
  const std::uint8_t second = around[first + 1 + turned], third = around[first + 2 - turned];
  const float whole = 32767 * shares[first][i];
  const auto narrowed = [&](std::size_t c) {
    return static_cast<std::int16_t>(rounded(whole * shares[c][i]));
  };
  return {{static_cast<std::uint8_t>(first), second, third}, narrowed(second), narrowed(third)};
}

class Builder {
 public:
  Builder(const Model& model, const Tissue& tissue, const TissueNodes& hold,
          std::span<const std::uint32_t> lane)
      : tissue_(tissue), hold_(hold), normals_(rest_normals(tissue)) {
    const std::size_t nodes = hold.nodes.size();
    lane_.reserve(nodes);
    rest_.reserve(3 * nodes);
    for (const std::uint32_t node : hold.nodes) {
      lane_.push_back(lane[node]);
      for (Eigen::Index c = 0; c < 3; ++c) rest_.push_back(model.nodes(static_cast<Eigen::Index>(node), c));
    }
    last_cell_.resize(nodes);
    place_.resize(nodes);
  }

  VertexGroups build() {
    out_.vertices = static_cast<std::size_t>(tissue_.V.rows());
    if (out_.vertices == 0) return std::move(out_);
    Order order(out_.vertices);
    std::iota(order.begin(), order.end(), 0U);
    GroupNodes nodes = nodes_of(order, hold_);
    // Along Morton's curve, too, each node is in one group at least: mostly that is answer enough.
    out_.in_order = local_enough(nodes.node.size(), hold_.nodes.size());
    if (!out_.in_order) {
      Order morton = morton_order(tissue_.V);
      GroupNodes along = nodes_of(morton, hold_);
      out_.in_order = local_enough(nodes.node.size(), along.node.size());
      if (!out_.in_order) {
        order.swap(morton);
        nodes = std::move(along);
      }
    }
    const GroupCells cells = share_palettes(nodes, VertexGroups::most_lanes, VertexGroups::most_groups);
    out_.cells.reserve(cells.end.size());
    out_.rows.reserve(VertexGroups::most_lanes * cells.end.size());
    out_.groups.reserve(nodes.groups());
    out_.corners.reserve(kGroupSize * nodes.groups());
    out_.narrow.reserve(3 * kGroupSize * nodes.groups());
    out_.normal.reserve(2 * kGroupSize * nodes.groups());
    for (const std::span<const std::uint32_t> groups : by_last_slab(cells, nodes, lane_))
      add_cell(order, nodes, groups);
    if (!out_.in_order) {
      out_.vertex = std::move(order);
      out_.vertex.resize(kGroupSize * out_.groups.size(), out_.vertex.back());
    }
    return std::move(out_);
  }

 private:
  static bool local_enough(std::size_t own, std::size_t along) {
    return static_cast<double>(own) <= kLocalEnough * static_cast<double>(along);
  }

  void add_cell(const Order& order, const GroupNodes& nodes, std::span<const std::uint32_t> groups) {
    const auto number = static_cast<std::uint32_t>(out_.cells.size() + 1);
    palette_.clear();
    for (const std::uint32_t g : groups) {
      for (const std::uint32_t node : nodes.of(g)) {
        if (std::exchange(last_cell_[node], number) != number) palette_.emplace_back(lane_[node], node);
      }
    }
    std::sort(palette_.begin(), palette_.end());
    for (std::size_t i = 0; i < palette_.size(); ++i)
      place_[palette_[i].second] = static_cast<std::uint8_t>(i);
    VertexGroups::Cell cell{};
    cell.palette = static_cast<std::uint32_t>(out_.rows.size());
    cell.count = static_cast<std::uint32_t>((palette_.size() + kGroupSize - 1) / kGroupSize * kGroupSize);
    for (std::size_t i = 0; i < cell.count; ++i)
      out_.rows.push_back(3 * palette_[std::min(i, palette_.size() - 1)].first);
    for (const std::uint32_t g : groups) {
      add_group(static_cast<std::uint32_t>(kGroupSize * g), vertices_of(order, g));
    }
    cell.end = static_cast<std::uint32_t>(out_.groups.size());
    out_.cells.push_back(cell);
  }

  AtRest at_rest(std::span<const std::uint32_t> vertices) const {
    AtRest out;
    for (std::size_t i = 0; i < kGroupSize; ++i) {
      const std::size_t v = vertices[std::min(i, vertices.size() - 1)];
      const auto place = [&](std::size_t c) { return &rest_[3 * std::size_t{hold_.corners[v][c]}]; };
      const float *const b = tissue_.barycentric.data() + 4 * v, *const n = normals_.data() + 3 * v,
                         *const from = place(0);
      for (std::size_t c = 0; c < 3; ++c) {
        out.barycentric[c][i] = b[c + 1];
        out.normal[c][i] = n[c];
        const float* const to = place(c + 1);
        for (std::size_t k = 0; k < 3; ++k) out.edge[c][k][i] = to[k] - from[k];
      }
    }
    return out;
  }

  void add_group(std::uint32_t first, std::span<const std::uint32_t> vertices) {
    const AtRest rest = at_rest(vertices);
    float low = 0, high = 0;
    for (const Lanes& b : rest.barycentric) {
      for (const float number : b) {
        low = std::min(low, number);
        high = std::max(high, number);
      }
    }
    const float step = (high - low) / 65535;
    const auto close = [&](float reach) { return step / 2 * reach <= kNarrowed; };
    const bool narrow = step > 0 && (close(rest.far_reach()) || close(rest.reach()));
    VertexGroups::Group group{};
    group.first = first;
    group.low = low;
    group.step = narrow ? step : 0;
    group.data = static_cast<std::uint32_t>(narrow ? out_.narrow.size() : out_.wide.size());
    out_.groups.push_back(group);

    const std::array<Lanes, 3> shares = rest.shares();
    std::array<std::uint32_t, kGroupSize> corners;
    std::array<std::int16_t, 2 * kGroupSize> normal;
    std::array<float, 3 * kGroupSize> numbers;
    for (std::size_t i = 0; i < kGroupSize; ++i) {
      const Turned turned = turn(shares, i);
      const auto& of_tet = hold_.corners[vertices[std::min(i, vertices.size() - 1)]];
      corners[i] = place_[of_tet[0]];
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t corner = turned.corner[c];
        corners[i] |= std::uint32_t{place_[of_tet[corner + 1]]} << (8 * (c + 1));
        numbers[kGroupSize * c + i] = rest.barycentric[corner][i];
      }
      normal[i] = turned.second;
      normal[kGroupSize + i] = turned.third;
    }
    append(corners, out_.corners);
    append(normal, out_.normal);
    if (!narrow) return append(numbers, out_.wide);
    std::array<std::uint16_t, 3 * kGroupSize> narrowed;
    for (std::size_t i = 0; i < numbers.size(); ++i)
      narrowed[i] = static_cast<std::uint16_t>(rounded(std::min(65535.0F, (numbers[i] - low) / step)));
    append(narrowed, out_.narrow);
  }

  template <class Row, class Rows>
  static void append(const Row& row, Rows& rows) {
    rows.insert(rows.end(), row.begin(), row.end());
  }

  const Tissue& tissue_;
  const TissueNodes& hold_;
  // By place in hold_.nodes: lane, position, the last cell that took it in, and its place in that palette.
  std::vector<std::uint32_t> lane_, last_cell_;
  std::vector<float> rest_;
  std::vector<std::uint8_t> place_;
  PointsF normals_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> palette_;  // lanes and places in hold_.nodes
  VertexGroups out_;
};

}  // namespace

PointsF rest_normals(const Tissue& tissue) {
  PointsF out = PointsF::Zero(tissue.V.rows(), 3);
  for (Eigen::Index f = 0; f < tissue.F.rows(); ++f) {
    const auto corner = [&](int c) -> Eigen::RowVector3f { return tissue.V.row(tissue.F(f, c)); };
    const Eigen::RowVector3f normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    for (int c = 0; c < 3; ++c) out.row(tissue.F(f, c)) += normal;
  }
  for (Eigen::Index v = 0; v < out.rows(); ++v) {
    const float length = out.row(v).norm();
    if (length > 0) out.row(v) /= length;
  }
  return out;
}

Eigen::Vector3f normal_shares(const Eigen::Matrix3f& edges, const Eigen::Vector3f& normal) {
  const Eigen::Vector3f shares = edges.transpose() * normal;
  const float most = shares.cwiseAbs().maxCoeff();
  return most > 0 ? Eigen::Vector3f(shares / most) : Eigen::Vector3f(Eigen::Vector3f::Zero());
}

VertexGroups group_vertices(const Model& model, const Tissue& tissue, const TissueNodes& hold,
                            std::span<const std::uint32_t> lane) {
  return Builder(model, tissue, hold, lane).build();
}

}  // namespace ecorche::runtime
