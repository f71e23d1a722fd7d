// SPDX-License-Identifier: Apache-2.0
#include "app/bone_overlaps.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ecorche::app {
namespace {

constexpr double kTouchingMm = 3;

bool same_motion(const RigidTransform& motion) {
  return motion.q.vec().norm() < 1e-9 && motion.t.norm() < 1e-6;
}

Eigen::AlignedBox3d moved(const Eigen::AlignedBox3d& box, const RigidTransform& motion) {
  Eigen::AlignedBox3d out;
  for (int corner = 0; corner < 8; ++corner)
    out.extend(motion * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  return out;
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

void BoneOverlaps::build_trees(Bone& bone) {
  if (bone.trees) return;
  const Tissue& tissue = model_.tissues[bone.tissue];
  const SurfaceMesh surface{tissue.V.cast<double>(), tissue.F};
  bone.trees.emplace(Trees{geometry::FaceTree(surface), geometry::WindingTree(surface)});
}

double BoneOverlaps::depth(const Bone& in, const Eigen::Vector3d& p) {
  if (!in.box.contains(p) || in.trees->winding(p) <= 0.5) return 0;
  return std::sqrt(in.trees->faces.nearest(p).squared);
}

// What the two overlap by in the scan, as bones do that touch there.
double BoneOverlaps::touching(std::size_t of, std::size_t in) {
  const auto [found, fresh] = touching_.try_emplace({of, in}, 0.0);
  double& mm = found->second;
  for (std::size_t v = 0; fresh && v < bones_[of].vertex.size() && mm < kTouchingMm; ++v)
    mm = std::min(kTouchingMm, std::max(mm, depth(bones_[in], bones_[of].vertex[v])));
  return mm;
}

// Of bones that move against each other and whose boxes meet, each with each; `look` says whether that is
// enough.
template <class Look>
void BoneOverlaps::each_pair(std::span<const RigidTransform> segments, Look&& look) {
  for (std::size_t a = 0; a < bones_.size(); ++a) {
    for (std::size_t b = 0; b < bones_.size(); ++b) {
      if (bones_[a].segment == bones_[b].segment) continue;
      const RigidTransform motion = segments[bones_[b].segment].inverse() * segments[bones_[a].segment];
      if (same_motion(motion) || !moved(bones_[a].box, motion).intersects(bones_[b].box)) continue;
      build_trees(bones_[b]);
      if (look(a, b, motion)) return;
    }
  }
}

// The vertex of bone `a` that lies deepest in `b`, the first of those as deep; no more is looked for once one
// lies deeper than `enough`.
BoneOverlaps::Depth BoneOverlaps::overlap(std::size_t a, std::size_t b, const RigidTransform& motion,
                                          double enough) {
  const std::vector<Eigen::Vector3d>& vertex = bones_[a].vertex;
  const Bone& in = bones_[b];
  const double granted = touching(a, b);
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, vertex.size(), 256), Depth{},
      [&](const auto& range, Depth deepest) {
        for (std::size_t v = range.begin(); v < range.end() && deepest.mm <= enough; ++v) {
          const double now = depth(in, motion * vertex[v]);
          if (now - granted <= deepest.mm) continue;
          const double beyond = now - std::max(granted, depth(in, vertex[v]));
          if (beyond > deepest.mm) deepest = {beyond, v};
        }
        return deepest;
      },
      [](const Depth& x, const Depth& y) {
        if (x.mm != y.mm) return x.mm > y.mm ? x : y;
        return x.vertex < y.vertex ? x : y;
      });
}

runtime::BoneOverlap BoneOverlaps::deepest(std::span<const RigidTransform> segments) {
  runtime::BoneOverlap out;
  each_pair(segments, [&](std::size_t a, std::size_t b, const RigidTransform& motion) {
    const Depth here = overlap(a, b, motion, std::numeric_limits<double>::infinity());
    if (here.mm > out.mm) out = {bones_[a].tissue, bones_[b].tissue, here.mm, bones_[a].vertex[here.vertex]};
    return false;
  });
  return out;
}

bool BoneOverlaps::meet(std::span<const RigidTransform> segments, double by_mm) {
  bool met = false;
  each_pair(segments, [&](std::size_t a, std::size_t b, const RigidTransform& motion) {
    met = overlap(a, b, motion, by_mm).mm > by_mm;
    return met;
  });
  return met;
}

}  // namespace ecorche::app
