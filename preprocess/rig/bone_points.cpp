// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/bone_points.hpp"

#include <algorithm>
#include <numeric>
#include <optional>
#include <set>

#include "preprocess/rig/bone_end.hpp"
#include "preprocess/rig/facing.hpp"
#include "preprocess/rig/vertex_order.hpp"

namespace ecorche::rig {
namespace {

// In shares of `whole`, from a corner at 0 to the other at 1.
Eigen::AlignedBox3d within(const Eigen::AlignedBox3d& shares, const Eigen::AlignedBox3d& whole) {
  const Eigen::Vector3d size = whole.sizes();
  // From the nearer corner: a share of 0 or 1 is that corner to the last digit, and takes the vertex that
  // lies there.
  return {whole.min() + shares.min().cwiseProduct(size),
          whole.max() - (Eigen::Vector3d::Ones() - shares.max()).cwiseProduct(size)};
}

}  // namespace

const CaseBone* BonePoints::case_bone(const std::string& name) const {
  const auto found = std::find_if(patient_.bones.begin(), patient_.bones.end(),
                                  [&](const CaseBone& b) { return b.name == name; });
  return found == patient_.bones.end() ? nullptr : &*found;
}

const SurfaceMesh* BonePoints::bone(const std::string& name) {
  const CaseBone* found = case_bone(name);
  if (found == nullptr) return nullptr;
  const auto [entry, fresh] = single_.try_emplace(name);
  if (fresh) entry->second = by_place(found->surface, found->segment);
  return &entry->second;
}

const SurfaceMesh& BonePoints::segment(const std::string& name) {
  const auto [entry, fresh] = segments_.try_emplace(name);
  SurfaceMesh& all = entry->second;
  if (!fresh) return all;
  Eigen::Index vertices = 0, faces = 0;
  for (const CaseBone& bone : patient_.bones) {
    if (bone.segment != name) continue;
    vertices += bone.surface.V.rows();
    faces += bone.surface.F.rows();
  }
  all.V.resize(vertices, 3);
  all.F.resize(faces, 3);
  vertices = faces = 0;
  for (const CaseBone& bone : patient_.bones) {
    if (bone.segment != name) continue;
    all.V.middleRows(vertices, bone.surface.V.rows()) = bone.surface.V;
    all.F.middleRows(faces, bone.surface.F.rows()) =
        (bone.surface.F.array() + static_cast<std::int32_t>(vertices)).matrix();
    vertices += bone.surface.V.rows();
    faces += bone.surface.F.rows();
  }
  all = by_place(all, name);
  return all;
}

std::string BonePoints::owner(const RegionUse& use) const {
  if (!use.segment.empty()) return use.segment;
  std::string single = use.bone;
  for (const Region& region : patient_.regions) {
    if (use.region.empty() || region.name != use.region) continue;
    if (region.bone.empty()) return region.segment;
    single = region.bone;
  }
  const CaseBone* found = case_bone(single);
  return found == nullptr ? "" : found->segment;
}

std::string BonePoints::segment_of(const std::string& region) const {
  const auto found = std::find_if(patient_.regions.begin(), patient_.regions.end(),
                                  [&](const Region& r) { return r.name == region; });
  return found == patient_.regions.end() ? "" : found->segment;
}

SurfacePoints BonePoints::region(const std::string& name) {
  const auto region = std::find_if(patient_.regions.begin(), patient_.regions.end(),
                                   [&](const Region& r) { return r.name == name; });
  if (region == patient_.regions.end()) return {};
  const SurfaceMesh* surface = region->bone.empty() ? &segment(region->segment) : bone(region->bone);
  if (surface == nullptr || surface->V.rows() == 0) return {};
  const Points& V = surface->V;
  const Eigen::AlignedBox3d whole(V.colwise().minCoeff().transpose(), V.colwise().maxCoeff().transpose());
  std::optional<BoneEnd> end;
  if (!region->near.empty()) {
    end = bone_end(*surface, segment(region->near));
    if (!end) return {};
  }
  std::set<Eigen::Index> rows;
  for (const Eigen::AlignedBox3d& said : region->boxes) {
    const Eigen::AlignedBox3d box = region->of_bones ? within(said, whole) : said;
    for (Eigen::Index v = 0; v < V.rows(); ++v) {
      const Eigen::Vector3d at = V.row(v).transpose();
      if (box.contains(end ? end->place(at) : at)) rows.insert(v);
    }
  }
  for (Eigen::Index p = 0; p < region->points.rows(); ++p) {
    Eigen::Index nearest = 0;
    (V.rowwise() - region->points.row(p)).rowwise().squaredNorm().minCoeff(&nearest);
    rows.insert(nearest);
  }
  SurfacePoints out = surface_points(*surface, {rows.begin(), rows.end()});
  out.found = end.has_value();
  if (end) out.along = end->axes * region->along;
  return out;
}

const SurfacePoints& BonePoints::of(const RegionUse& use) {
  const Key key{{use.region, use.bone, use.facing, use.segment, use.facing_segment},
                {use.looks.x(), use.looks.y(), use.looks.z(), use.along.x(), use.along.y(), use.along.z()}};
  const auto [entry, fresh] = found_.try_emplace(key);
  if (fresh) {
    entry->second = find(use);
    entry->second.right = owner(use).ends_with("_right");
  }
  return entry->second;
}

SurfacePoints BonePoints::find(const RegionUse& use) {
  const auto whole = [](const SurfaceMesh& surface) {
    std::vector<Eigen::Index> all(static_cast<std::size_t>(surface.V.rows()));
    std::iota(all.begin(), all.end(), Eigen::Index{0});
    return surface_points(surface, all);
  };
  if (!use.region.empty()) return region(use.region);
  if (!use.segment.empty()) {
    const SurfaceMesh& own = segment(use.segment);
    if (use.facing_segment.empty()) return whole(own);
    const SurfaceMesh& other = segment(use.facing_segment);
    SurfacePoints points = facing_points(own, other, use.looks);
    if (const auto end = use.along.isZero() ? std::nullopt : bone_end(own, other))
      points.along = end->axes * use.along;
    return points;
  }
  const SurfaceMesh* own = bone(use.bone);
  if (own == nullptr) return {};
  if (use.facing.empty()) return whole(*own);
  const SurfaceMesh* other = bone(use.facing);
  return other == nullptr ? SurfacePoints{} : facing_points(*own, *other, use.looks);
}

}  // namespace ecorche::rig
