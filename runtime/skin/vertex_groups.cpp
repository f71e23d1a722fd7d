// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/vertex_groups.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace ecorche::runtime {
namespace {

constexpr std::size_t kSize = VertexGroups::size;
constexpr float kNarrowed = 2e-4F;    // mm that narrowing may move a vertex at rest
constexpr double kLocalEnough = 1.7;  // palettes of the own order over those of Morton's, where it is kept

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

// The nodes that up to 16 vertices hang on, each once. A hash table of four times as many places as nodes,
// which a stamp empties: models are grouped while somebody waits for them.
class Palette {
 public:
  Palette(const Model& model, const Tissue& tissue) : model_(model), tissue_(tissue) {}

  void gather(std::span<const std::uint32_t> vertices) {
    ++stamp_;
    nodes_.clear();
    for (const std::uint32_t v : vertices) {
      for (int c = 0; c < 4; ++c) add(static_cast<std::uint32_t>(model_.tets(tissue_.tet[v], c)));
    }
  }
  void sort() {
    std::sort(nodes_.begin(), nodes_.end());
    for (std::size_t i = 0; i < nodes_.size(); ++i) slot_of(nodes_[i]).place = static_cast<std::uint8_t>(i);
  }
  const std::vector<std::uint32_t>& nodes() const { return nodes_; }
  /// Of a node of it, once sorted.
  std::uint8_t place(std::int32_t node) { return slot_of(static_cast<std::uint32_t>(node)).place; }

 private:
  struct Slot {
    std::uint32_t stamp = 0, node = 0;
    std::uint8_t place = 0;
  };
  // The node's own, or the free one where it would stand.
  Slot& slot_of(std::uint32_t node) {
    for (std::size_t at = node * 0x9e3779b1U >> 24U;; at = (at + 1) % slots_.size()) {
      if (slots_[at].stamp != stamp_ || slots_[at].node == node) return slots_[at];
    }
  }
  void add(std::uint32_t node) {
    Slot& slot = slot_of(node);
    if (slot.stamp == stamp_) return;
    slot.stamp = stamp_;
    slot.node = node;
    nodes_.push_back(node);
  }

  const Model& model_;
  const Tissue& tissue_;
  std::array<Slot, 256> slots_{};
  std::uint32_t stamp_ = 0;
  std::vector<std::uint32_t> nodes_;
};

// Of all groups together: nodes of palettes, and rows that these take (VertexGroups::rows).
struct Palettes {
  std::size_t nodes = 0, rows = 0;
};

Palettes palettes_of(const Model& model, const Tissue& tissue, const Order& order) {
  Palettes sum;
  Palette palette(model, tissue);
  for (std::size_t v = 0; v < order.size(); v += kSize) {
    palette.gather(std::span(order).subspan(v, std::min(kSize, order.size() - v)));
    sum.nodes += palette.nodes().size();
    sum.rows += (palette.nodes().size() + 7) / 8 * 8;
  }
  return sum;
}

Eigen::Matrix3f edges(const Model& model, std::int32_t tet) {
  Eigen::Matrix3f out;
  for (int c = 0; c < 3; ++c) {
    out.col(c) = (model.nodes.row(model.tets(tet, c + 1)) - model.nodes.row(model.tets(tet, 0))).transpose();
  }
  return out;
}

void add_group(const Model& model, const Tissue& tissue, std::span<const std::uint32_t> lane,
               std::span<const std::uint32_t> vertices, const PointsF& normals, Palette& nodes,
               VertexGroups& out) {
  VertexGroups::Group group{};
  nodes.gather(vertices);
  nodes.sort();
  const std::vector<std::uint32_t>& palette = nodes.nodes();
  group.palette = static_cast<std::uint32_t>(out.rows.size());
  group.count = static_cast<std::uint32_t>((palette.size() + 7) / 8 * 8);
  for (std::size_t i = 0; i < group.count; ++i)
    out.rows.push_back(3 * lane[palette[std::min(i, palette.size() - 1)]]);

  const auto at = [&](std::size_t i) {
    return static_cast<Eigen::Index>(vertices[std::min(i, vertices.size() - 1)]);
  };
  for (int c = 0; c < 4; ++c) {
    for (std::size_t i = 0; i < kSize; ++i) {
      out.corner.push_back(nodes.place(model.tets(tissue.tet[static_cast<std::size_t>(at(i))], c)));
    }
  }

  float low = 0, high = 0, reach = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const auto b = tissue.barycentric.row(at(i)).tail<3>();
    low = std::min(low, b.minCoeff());
    high = std::max(high, b.maxCoeff());
    reach = std::max(reach, edges(model, tissue.tet[vertices[i]]).colwise().norm().sum());
  }
  const float step = (high - low) / 65535;
  const bool narrow = step > 0 && step / 2 * reach <= kNarrowed;
  group.low = low;
  group.step = narrow ? step : 0;
  group.data = static_cast<std::uint32_t>(narrow ? out.narrow.size() : out.wide.size());
  for (int c = 1; c < 4; ++c) {
    for (std::size_t i = 0; i < kSize; ++i) {
      const float b = tissue.barycentric(at(i), c);
      if (narrow) {
        out.narrow.push_back(
            static_cast<std::uint16_t>(std::clamp(std::round((b - low) / step), 0.0F, 65535.0F)));
      } else {
        out.wide.push_back(b);
      }
    }
  }

  std::array<Eigen::Vector3f, kSize> shares;
  for (std::size_t i = 0; i < kSize; ++i) {
    shares[i] = normal_shares(model, tissue.tet[static_cast<std::size_t>(at(i))], normals.row(at(i)));
  }
  for (int c = 0; c < 3; ++c) {
    for (const Eigen::Vector3f& share : shares) {
      out.normal.push_back(static_cast<std::int16_t>(std::lround(32767 * share[c])));
    }
  }
  out.groups.push_back(group);
}

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
  VertexGroups out;
  out.vertices = static_cast<std::size_t>(tissue.V.rows());
  if (out.vertices == 0) return out;
  Order order(out.vertices);
  std::iota(order.begin(), order.end(), 0U);
  const Order morton = morton_order(tissue.V);
  const Palettes own = palettes_of(model, tissue, order), along = palettes_of(model, tissue, morton);
  out.in_order = static_cast<double>(own.nodes) <= kLocalEnough * static_cast<double>(along.nodes);
  if (!out.in_order) order = morton;

  const PointsF normals = rest_normals(tissue);
  const std::size_t groups = (order.size() + kSize - 1) / kSize;
  out.groups.reserve(groups);
  out.rows.reserve(out.in_order ? own.rows : along.rows);
  out.corner.reserve(4 * kSize * groups);
  out.narrow.reserve(3 * kSize * groups);
  out.normal.reserve(3 * kSize * groups);
  Palette nodes(model, tissue);
  for (std::size_t v = 0; v < order.size(); v += kSize) {
    add_group(model, tissue, lane, std::span(order).subspan(v, std::min(kSize, order.size() - v)), normals,
              nodes, out);
  }
  if (!out.in_order) {
    out.vertex = std::move(order);
    out.vertex.resize(kSize * out.groups.size(), out.vertex.back());
  }
  return out;
}

}  // namespace ecorche::runtime
