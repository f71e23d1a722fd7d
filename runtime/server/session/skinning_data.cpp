// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/skinning_data.hpp"

#include <meshoptimizer.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "proto/arrays.hpp"
#include "proto/oct16.hpp"
#include "runtime/skin/vertex_groups.hpp"

namespace ecorche::server {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t kHungBytes = 36;

// One row after the other, little-endian.
class Rows {
 public:
  explicit Rows(std::size_t stride) : stride_(stride) {}
  template <class T>
  void put(T value) {
    const auto bytes = std::bit_cast<std::array<unsigned char, sizeof(T)>>(value);
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  std::vector<unsigned char> encoded() const {
    const std::size_t count = bytes_.size() / stride_;
    std::vector<unsigned char> out(meshopt_encodeVertexBufferBound(count, stride_));
    out.resize(meshopt_encodeVertexBuffer(out.data(), out.size(), bytes_.data(), count, stride_));
    return out;
  }
  std::uint32_t count() const { return static_cast<std::uint32_t>(bytes_.size() / stride_); }

 private:
  std::size_t stride_;
  std::vector<unsigned char> bytes_;
};

void put_point(const runtime::SkinPoint& point, std::array<std::int8_t, 2> normal, std::uint32_t influences,
               Rows& out) {
  for (const std::uint16_t n : point.rest) out.put(n);
  for (const std::int8_t n : normal) out.put(n);
  for (const std::uint16_t n : point.centre) out.put(n);
  out.put(std::uint16_t{0});
  for (std::uint32_t k = 0; k < influences; ++k) {
    out.put(point.segment[k]);
    out.put(point.weight[k]);
  }
}

std::array<std::int8_t, 2> normal_of(const PointsF& normals, std::uint32_t vertex) {
  std::array<std::int16_t, 3> unit{};
  for (std::size_t c = 0; c < 3; ++c)
    unit[c] = static_cast<std::int16_t>(
        std::lround(32767 * normals(static_cast<Eigen::Index>(vertex), static_cast<Eigen::Index>(c))));
  std::array<std::int8_t, 2> out{};
  wire::to_oct16(unit, out);
  return out;
}

v1::Array append_bytes(wire::Payload& payload, const std::vector<unsigned char>& bytes) {
  return wire::append(payload, std::span<const std::uint8_t>(bytes), 1);
}

}  // namespace

SkinningTables::SkinningTables(const Skeleton& rig, std::vector<NamedPose> measured) {
  for (NamedPose& pose : measured) {
    names_.push_back(std::move(pose.name));
    poses_.push_back(std::move(pose.pose));
  }
  // Poses of a library leave out joints.
  names_.insert(names_.end(), {"halfway_low", "halfway_high"});
  for (Pose& pose : runtime::halfway_poses(rig)) poses_.push_back(std::move(pose));
}

void SkinningTables::make(const runtime::BodyPoser& poser, const LevelOf& level_of,
                          const std::vector<std::uint32_t>& tissues) {
  Made made;
  const std::vector<runtime::TissueSkinning> folded =
      runtime::fold_to_vertices(poser, tissues, poses_, made.error);
  std::vector<Made> all(tissues.size(), made);
  tbb::parallel_for(std::size_t{0}, tissues.size(), [&](std::size_t i) {
    const Tissue& tissue = poser.model().tissues[tissues[i]];
    const PointsF normals = runtime::rest_normals(tissue);
    all[i].influences = folded[i].influences;
    for (std::uint32_t level = 0; level <= coarsest_level; ++level)
      all[i].levels[level] =
          pack(tissue, folded[i], normals, level == 0 ? nullptr : level_of(level, tissues[i]));
  });
  for (std::size_t i = 0; i < tissues.size(); ++i) tissues_[tissues[i]] = std::move(all[i]);
}

SkinningTables::Packed SkinningTables::pack(const Tissue& tissue, const runtime::TissueSkinning& skinning,
                                            const PointsF& normals, const MeshRows* level) {
  const auto count =
      static_cast<std::uint32_t>(level ? level->vertices.size() : static_cast<std::size_t>(tissue.V.rows()));
  std::vector<std::uint32_t> hung_row(skinning.vertices.size(), kNone);
  for (std::uint32_t h = 0; h < skinning.hung.size(); ++h) hung_row[skinning.hung[h].vertex] = h;
  Rows points(16 + 4 * std::size_t{skinning.influences}), hung(kHungBytes);
  std::vector<std::uint32_t> node_row(skinning.nodes.size(), kNone), nodes;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t v = level ? level->vertices[i] : i;
    put_point(skinning.vertices[v], normal_of(normals, v), skinning.influences, points);
    if (hung_row[v] == kNone) continue;
    const runtime::HungVertex& vertex = skinning.hung[hung_row[v]];
    hung.put(i);
    for (const std::uint32_t node : vertex.node) {
      if (node_row[node] == kNone) {
        node_row[node] = count + static_cast<std::uint32_t>(nodes.size());
        nodes.push_back(node);
      }
      hung.put(node_row[node]);
    }
    for (const float share : vertex.share) hung.put(share);
  }
  for (const std::uint32_t node : nodes)
    put_point(skinning.nodes[node], {-128, -128}, skinning.influences, points);
  return {.vertices = count,
          .points = points.count(),
          .hung = hung.count(),
          .point_bytes = points.count() > 0 ? points.encoded() : Bytes{},
          .hung_bytes = hung.count() > 0 ? hung.encoded() : Bytes{}};
}

void SkinningTables::describe(const runtime::BodyPoser& poser, const LevelOf& level_of,
                              const std::vector<std::uint32_t>& tissues, std::uint32_t level,
                              v1::SkinningData& out, wire::Payload& payload) {
  const std::lock_guard lock(making_);
  tissues_.resize(poser.model().tissues.size());
  std::vector<std::uint32_t> missing;
  for (const std::uint32_t t : tissues) {
    if (!tissues_[t]) missing.push_back(t);
  }
  // While it waits for its own loops, the thread must not take up another job: that one could want the same.
  if (!missing.empty()) tbb::this_task_arena::isolate([&] { make(poser, level_of, missing); });
  const runtime::QuantiseBox box = runtime::skinning_box(poser.model());
  out.mutable_box()->set_low_x(box.low[0]);
  out.mutable_box()->set_low_y(box.low[1]);
  out.mutable_box()->set_low_z(box.low[2]);
  out.mutable_box()->set_step(box.step);
  for (const std::string& name : names_) out.add_measured(name);
  for (const std::uint32_t t : tissues) {
    const Made& made = *tissues_[t];
    const Packed& packed = made.levels[level];
    v1::TissueSkinning& tissue = *out.add_tissues();
    tissue.set_tissue(t);
    tissue.set_vertices(packed.vertices);
    tissue.set_influences(made.influences);
    tissue.set_point_count(packed.points);
    *tissue.mutable_points() = append_bytes(payload, packed.point_bytes);
    tissue.set_hung_count(packed.hung);
    if (packed.hung > 0) *tissue.mutable_hung() = append_bytes(payload, packed.hung_bytes);
    out.set_largest_error(std::max(out.largest_error(), made.error.largest_mm));
    out.set_largest_normal_error(std::max(out.largest_normal_error(), made.error.largest_turn));
    out.set_usual_normal_error(std::max(out.usual_normal_error(), made.error.usual_turn));
  }
}

}  // namespace ecorche::server
