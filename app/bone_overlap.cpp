// SPDX-License-Identifier: Apache-2.0
#include "app/bone_overlap.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <cmath>
#include <limits>

namespace ecorche::app {
namespace {

SurfaceMesh surface_of(const Tissue& bone) {
  return {bone.V.cast<double>(), bone.F};
}

bool same_motion(const RigidTransform& motion) {
  return motion.q.vec().norm() < 1e-9 && motion.t.norm() < 1e-6;
}

}  // namespace

BoneOverlap::BoneOverlap(const Model& model) {
  for (const Tissue& tissue : model.tissues) {
    if (tissue.segment == Tissue::by_tets || tissue.F.rows() == 0) continue;
    const SurfaceMesh surface = surface_of(tissue);
    Bone bone{static_cast<std::size_t>(tissue.segment),
              {},
              {},
              geometry::FaceTree(surface),
              geometry::WindingTree(surface)};
    for (Eigen::Index v = 0; v < surface.V.rows(); ++v) {
      bone.vertex.emplace_back(surface.V.row(v).transpose());
      bone.box.extend(bone.vertex.back());
    }
    bones_.push_back(std::move(bone));
  }
}

// The deepest vertex; no more is looked for once one is deeper than `enough`.
double BoneOverlap::depth(const Bone& of, const Bone& in, const RigidTransform& motion, double enough) const {
  Eigen::AlignedBox3d moved;
  for (int corner = 0; corner < 8; ++corner)
    moved.extend(motion * of.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  if (!moved.intersects(in.box)) return 0;
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, of.vertex.size(), 256), 0.0,
      [&](const auto& range, double deepest) {
        for (std::size_t v = range.begin(); v < range.end() && deepest <= enough; ++v) {
          const Eigen::Vector3d p = motion * of.vertex[v];
          if (in.box.contains(p) && in.winding(p) > 0.5)
            deepest = std::max(deepest, std::sqrt(in.faces.nearest(p).squared));
        }
        return deepest;
      },
      [](double a, double b) { return std::max(a, b); });
}

double BoneOverlap::depth_at_rest(std::size_t of, std::size_t in) {
  const auto [found, fresh] = at_rest_.try_emplace({of, in}, 0.0);
  if (fresh)
    found->second = depth(bones_[of], bones_[in], RigidTransform(), std::numeric_limits<double>::infinity());
  return found->second;
}

bool BoneOverlap::meet(std::span<const RigidTransform> segments, double by_mm) {
  for (std::size_t a = 0; a < bones_.size(); ++a) {
    for (std::size_t b = 0; b < bones_.size(); ++b) {
      const RigidTransform motion = segments[bones_[b].segment].inverse() * segments[bones_[a].segment];
      if (a == b || bones_[a].segment == bones_[b].segment || same_motion(motion)) continue;
      if (depth(bones_[a], bones_[b], motion, std::numeric_limits<double>::min()) == 0) continue;
      const double allowed = depth_at_rest(a, b) + by_mm;
      if (depth(bones_[a], bones_[b], motion, allowed) > allowed) return true;
    }
  }
  return false;
}

}  // namespace ecorche::app
