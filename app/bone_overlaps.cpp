// SPDX-License-Identifier: Apache-2.0
#include "app/bone_overlaps.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <cmath>

namespace ecorche::app {
namespace {

bool same_motion(const RigidTransform& motion) {
  return motion.q.vec().norm() < 1e-9 && motion.t.norm() < 1e-6;
}

}  // namespace

BoneOverlaps::BoneOverlaps(const Model& model) : model_(model) {
  for (std::size_t t = 0; t < model.tissues.size(); ++t) {
    const Tissue& tissue = model.tissues[t];
    if (tissue.segment == Tissue::by_tets || tissue.F.rows() == 0) continue;
    Bone bone{t, static_cast<std::size_t>(tissue.segment), {}, {}, {}};
    for (Eigen::Index v = 0; v < tissue.V.rows(); ++v) {
      bone.vertex.emplace_back(tissue.V.row(v).cast<double>().transpose());
      bone.box.extend(bone.vertex.back());
    }
    bones_.push_back(std::move(bone));
  }
}

const BoneOverlaps::Trees& BoneOverlaps::trees(Bone& bone) {
  if (!bone.trees) {
    const Tissue& tissue = model_.tissues[bone.tissue];
    const SurfaceMesh surface{tissue.V.cast<double>(), tissue.F};
    bone.trees.emplace(Trees{geometry::FaceTree(surface), geometry::WindingTree(surface)});
  }
  return *bone.trees;
}

// Of the deepest vertex, the first of those as deep; no more is looked for once one is deeper than `enough`.
BoneOverlaps::Depth BoneOverlaps::depth(const Bone& of, Bone& in, const RigidTransform& motion,
                                        double enough) {
  Eigen::AlignedBox3d moved;
  for (int corner = 0; corner < 8; ++corner)
    moved.extend(motion * of.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  if (!moved.intersects(in.box)) return {};
  const Trees& within = trees(in);
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, of.vertex.size(), 256), Depth{},
      [&](const auto& range, Depth deepest) {
        for (std::size_t v = range.begin(); v < range.end() && deepest.mm <= enough; ++v) {
          const Eigen::Vector3d p = motion * of.vertex[v];
          if (!in.box.contains(p) || within.winding(p) <= 0.5) continue;
          const double mm = std::sqrt(within.faces.nearest(p).squared);
          if (mm > deepest.mm) deepest = {mm, v};
        }
        return deepest;
      },
      [](const Depth& a, const Depth& b) {
        if (a.mm != b.mm) return a.mm > b.mm ? a : b;
        return a.vertex < b.vertex ? a : b;
      });
}

double BoneOverlaps::depth_at_rest(std::size_t of, std::size_t in) {
  const auto [found, fresh] = at_rest_.try_emplace({of, in}, 0.0);
  if (fresh) found->second = depth(bones_[of], bones_[in], RigidTransform()).mm;
  return found->second;
}

// Of bones that move against each other, each with each; ends where `look` says that it is enough.
template <class Look>
void BoneOverlaps::each_pair(std::span<const RigidTransform> segments, Look&& look) {
  for (std::size_t a = 0; a < bones_.size(); ++a) {
    for (std::size_t b = 0; b < bones_.size(); ++b) {
      if (bones_[a].segment == bones_[b].segment) continue;
      const RigidTransform motion = segments[bones_[b].segment].inverse() * segments[bones_[a].segment];
      if (!same_motion(motion) && look(a, b, motion)) return;
    }
  }
}

runtime::BoneOverlap BoneOverlaps::deepest(std::span<const RigidTransform> segments) {
  runtime::BoneOverlap out;
  each_pair(segments, [&](std::size_t a, std::size_t b, const RigidTransform& motion) {
    const Depth here = depth(bones_[a], bones_[b], motion);
    if (here.mm <= out.mm) return false;
    const double beyond = here.mm - depth_at_rest(a, b);
    if (beyond > out.mm) out = {bones_[a].tissue, bones_[b].tissue, beyond, bones_[a].vertex[here.vertex]};
    return false;
  });
  return out;
}

bool BoneOverlaps::meet(std::span<const RigidTransform> segments, double by_mm) {
  bool met = false;
  each_pair(segments, [&](std::size_t a, std::size_t b, const RigidTransform& motion) {
    if (depth(bones_[a], bones_[b], motion, std::numeric_limits<double>::min()).mm == 0) return false;
    const double allowed = depth_at_rest(a, b) + by_mm;
    met = depth(bones_[a], bones_[b], motion, allowed).mm > allowed;
    return met;
  });
  return met;
}

}  // namespace ecorche::app
