// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/vertex_groups.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

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
  Order order(code.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return code[a] < code[b]; });
  return order;
}

// The nodes that the vertices of a cell hang on, each once, by lane. A hash table of four times as many
// places as nodes, which a stamp empties: models are grouped while somebody waits for them.
class Palette {
 public:
  Palette(const Model& model, const Tissue& tissue, std::span<const std::uint32_t> lane)
      : model_(model), tissue_(tissue), lane_(lane) {}

  void clear() {
    ++stamp_;
    lanes_.clear();
  }
  void gather(std::span<const std::uint32_t> vertices) {
    for (const std::uint32_t v : vertices) {
      for (int c = 0; c < 4; ++c) add(corner(v, c));
    }
  }
  void sort() {
    std::sort(lanes_.begin(), lanes_.end());
    for (std::size_t i = 0; i < lanes_.size(); ++i) slot_of(lanes_[i]).place = static_cast<std::uint8_t>(i);
  }
  const std::vector<std::uint32_t>& lanes() const { return lanes_; }
  /// Of a corner of a vertex' tet, once sorted.
  std::uint8_t place(std::uint32_t vertex, int c) { return slot_of(corner(vertex, c)).place; }

 private:
  struct Slot {
    std::uint32_t stamp = 0, lane = 0;
    std::uint8_t place = 0;
  };
  std::uint32_t corner(std::uint32_t vertex, int c) const {
    return lane_[static_cast<std::size_t>(model_.tets(tissue_.tet[vertex], c))];
  }
  // The lane's own, or the free one where it would stand.
  Slot& slot_of(std::uint32_t lane) {
    for (std::size_t at = lane * 0x9e3779b1U >> 24U;; at = (at + 1) % slots_.size()) {
      if (slots_[at].stamp != stamp_ || slots_[at].lane == lane) return slots_[at];
    }
  }
  void add(std::uint32_t lane) {
    Slot& slot = slot_of(lane);
    if (slot.stamp == stamp_) return;
    slot.stamp = stamp_;
    slot.lane = lane;
    lanes_.push_back(lane);
  }

  const Model& model_;
  const Tissue& tissue_;
  std::span<const std::uint32_t> lane_;
  std::array<Slot, 256> slots_{};
  std::uint32_t stamp_ = 0;
  std::vector<std::uint32_t> lanes_;
};

// The 16 vertices of a group, fewer in the last.
std::span<const std::uint32_t> vertices_of(const Order& order, std::size_t group) {
  return std::span(order).subspan(kGroupSize * group,
                                  std::min(kGroupSize, order.size() - kGroupSize * group));
}

GroupNodes nodes_of(const Order& order, Palette& palette) {
  GroupNodes out;
  for (std::size_t g = 0; kGroupSize * g < order.size(); ++g) {
    palette.clear();
    palette.gather(vertices_of(order, g));
    out.node.insert(out.node.end(), palette.lanes().begin(), palette.lanes().end());
    out.begin.push_back(static_cast<std::uint32_t>(out.node.size()));
  }
  return out;
}

// The groups of each cell, cells sorted by the slab of the last of their nodes.
std::vector<std::span<const std::uint32_t>> by_last_slab(const GroupCells& cells, const GroupNodes& nodes) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> slab_and_cell;
  for (std::uint32_t c = 0, g = 0; c < cells.end.size(); ++c) {
    std::uint32_t last = 0;
    for (; g < cells.end[c]; ++g) {
      for (const std::uint32_t lane : nodes.of(cells.group[g])) last = std::max(last, lane);
    }
    slab_and_cell.emplace_back(static_cast<std::uint32_t>(last / NodeClusters::slab), c);
  }
  std::sort(slab_and_cell.begin(), slab_and_cell.end());
  std::vector<std::span<const std::uint32_t>> out;
  for (const auto& [slab, c] : slab_and_cell) {
    const std::uint32_t first = c == 0 ? 0 : cells.end[c - 1];
    out.push_back(std::span(cells.group).subspan(first, cells.end[c] - first));
  }
  return out;
}

Eigen::Matrix3f edges(const Model& model, std::int32_t tet) {
  Eigen::Matrix3f out;
  for (int c = 0; c < 3; ++c) {
    out.col(c) = (model.nodes.row(model.tets(tet, c + 1)) - model.nodes.row(model.tets(tet, 0))).transpose();
  }
  return out;
}

// Corners 1 to 3 of a tet turned so that the first share of the normal is the largest and positive, and the
// others over it (VertexGroups::normal). To exchange two corners is to change the sign of every cross
// product.
struct Turned {
  std::array<int, 3> corner{1, 2, 3};
  std::int16_t second = VertexGroups::no_normal, third = 0;
};

Turned turn(const Eigen::Vector3f& shares) {
  Eigen::Index first = 0;
  if (!(shares.cwiseAbs().maxCoeff(&first) > 0)) return {};
  Eigen::Index second = (first + 1) % 3, third = (first + 2) % 3;
  if (shares[first] < 0) std::swap(second, third);
  const auto narrowed = [&](Eigen::Index i) {
    return static_cast<std::int16_t>(std::lround(32767 * shares[i] / shares[first]));
  };
  return {{static_cast<int>(first) + 1, static_cast<int>(second) + 1, static_cast<int>(third) + 1},
          narrowed(second),
          narrowed(third)};
}

class Builder {
 public:
  Builder(const Model& model, const Tissue& tissue, std::span<const std::uint32_t> lane)
      : model_(model), tissue_(tissue), palette_(model, tissue, lane), normals_(rest_normals(tissue)) {}

  VertexGroups build() {
    out_.vertices = static_cast<std::size_t>(tissue_.V.rows());
    if (out_.vertices == 0) return std::move(out_);
    Order order(out_.vertices);
    std::iota(order.begin(), order.end(), 0U);
    Order morton = morton_order(tissue_.V);
    GroupNodes nodes = nodes_of(order, palette_), along = nodes_of(morton, palette_);
    out_.in_order =
        static_cast<double>(nodes.node.size()) <= kLocalEnough * static_cast<double>(along.node.size());
    if (!out_.in_order) {
      order.swap(morton);
      nodes = std::move(along);
    }
    out_.groups.reserve(nodes.groups());
    out_.corners.reserve(kGroupSize * nodes.groups());
    out_.narrow.reserve(3 * kGroupSize * nodes.groups());
    out_.normal.reserve(2 * kGroupSize * nodes.groups());
    const GroupCells cells = share_palettes(nodes, VertexGroups::most_lanes, VertexGroups::most_groups);
    for (const std::span<const std::uint32_t> groups : by_last_slab(cells, nodes)) add_cell(order, groups);
    if (!out_.in_order) {
      out_.vertex = std::move(order);
      out_.vertex.resize(kGroupSize * out_.groups.size(), out_.vertex.back());
    }
    return std::move(out_);
  }

 private:
  void add_cell(const Order& order, std::span<const std::uint32_t> groups) {
    palette_.clear();
    for (const std::uint32_t g : groups) palette_.gather(vertices_of(order, g));
    palette_.sort();
    const std::vector<std::uint32_t>& lanes = palette_.lanes();
    VertexGroups::Cell cell{};
    cell.palette = static_cast<std::uint32_t>(out_.rows.size());
    cell.count = static_cast<std::uint32_t>((lanes.size() + kGroupSize - 1) / kGroupSize * kGroupSize);
    for (std::size_t i = 0; i < cell.count; ++i)
      out_.rows.push_back(3 * lanes[std::min(i, lanes.size() - 1)]);
    for (const std::uint32_t g : groups) {
      add_group(static_cast<std::uint32_t>(kGroupSize * g), vertices_of(order, g));
    }
    cell.end = static_cast<std::uint32_t>(out_.groups.size());
    out_.cells.push_back(cell);
  }

  void add_group(std::uint32_t first, std::span<const std::uint32_t> vertices) {
    VertexGroups::Group group{};
    group.first = first;
    float low = 0, high = 0, reach = 0;
    for (const std::uint32_t v : vertices) {
      const auto b = tissue_.barycentric.row(static_cast<Eigen::Index>(v)).tail<3>();
      low = std::min(low, b.minCoeff());
      high = std::max(high, b.maxCoeff());
      reach = std::max(reach, edges(model_, tissue_.tet[v]).colwise().norm().sum());
    }
    const float step = (high - low) / 65535;
    const bool narrow = step > 0 && step / 2 * reach <= kNarrowed;
    group.low = low;
    group.step = narrow ? step : 0;
    group.data = static_cast<std::uint32_t>(narrow ? out_.narrow.size() : out_.wide.size());

    std::array<Turned, kGroupSize> turned;
    const auto at = [&](std::size_t i) { return vertices[std::min(i, vertices.size() - 1)]; };
    for (std::size_t i = 0; i < kGroupSize; ++i) {
      const std::uint32_t v = at(i);
      turned[i] = turn(normal_shares(model_, tissue_.tet[v], normals_.row(static_cast<Eigen::Index>(v))));
      std::uint32_t corners = palette_.place(v, 0);
      for (unsigned c = 0; c < 3; ++c) {
        corners |= std::uint32_t{palette_.place(v, turned[i].corner[c])} << (8 * (c + 1));
      }
      out_.corners.push_back(corners);
    }
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < kGroupSize; ++i) {
        const float b = tissue_.barycentric(static_cast<Eigen::Index>(at(i)), turned[i].corner[c]);
        if (narrow) {
          out_.narrow.push_back(
              static_cast<std::uint16_t>(std::clamp(std::round((b - low) / step), 0.0F, 65535.0F)));
        } else {
          out_.wide.push_back(b);
        }
      }
    }
    for (const Turned& t : turned) out_.normal.push_back(t.second);
    for (const Turned& t : turned) out_.normal.push_back(t.third);
    out_.groups.push_back(group);
  }

  const Model& model_;
  const Tissue& tissue_;
  Palette palette_;
  PointsF normals_;
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

Eigen::Vector3f normal_shares(const Model& model, std::int32_t tet, const Eigen::Vector3f& normal) {
  const Eigen::Vector3f shares = edges(model, tet).transpose() * normal;
  const float most = shares.cwiseAbs().maxCoeff();
  return most > 0 ? Eigen::Vector3f(shares / most) : Eigen::Vector3f(Eigen::Vector3f::Zero());
}

VertexGroups group_vertices(const Model& model, const Tissue& tissue, std::span<const std::uint32_t> lane) {
  return Builder(model, tissue, lane).build();
}

}  // namespace ecorche::runtime
