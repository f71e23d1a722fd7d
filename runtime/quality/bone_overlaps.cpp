// SPDX-License-Identifier: Apache-2.0
#include "runtime/quality/bone_overlaps.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ecorche::runtime {
namespace {

constexpr double kGridMm = 4, kMostCells = 32768;  // of what saves most questions to the trees
constexpr double kGrainMm = 0.01;                  // of float32, and of the grid's numbers

Eigen::AlignedBox3d moved_box(const Eigen::AlignedBox3d& box, const RigidTransform& motion) {
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
    Bone bone{t, static_cast<std::size_t>(tissue.segment), {}, {}, {}, {}};
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
  bone.trees.emplace(SurfaceMesh{tissue.V.cast<double>(), tissue.F});
  const double spacing = std::max(kGridMm, std::cbrt(bone.box.volume() / kMostCells));
  if (is_closed(tissue.F)) bone.grid.emplace(*bone.trees, bone.box, spacing);
}

// Where that is `enough` or less, no more than it.
double BoneOverlaps::depth(const Bone& in, const Eigen::Vector3d& p, double enough) {
  if (!in.box.contains(p)) return 0;
  if (in.grid && in.grid->most(p.cast<float>()) < enough - kGrainMm) return 0;
  return in.trees->depth(p);
}

// What the two overlap by in the scan, as bones do that touch there.
double BoneOverlaps::touching(std::size_t of, std::size_t in) {
  const auto [found, fresh] = touching_.try_emplace({of, in}, 0.0);
  double& mm = found->second;
  for (std::size_t v = 0; fresh && v < bones_[of].vertex.size() && mm < kTouchingMm; ++v)
    mm = std::min(kTouchingMm, std::max(mm, depth(bones_[in], bones_[of].vertex[v], mm)));
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
      if (stands_still(motion) || !moved_box(bones_[a].box, motion).intersects(bones_[b].box)) continue;
      build_trees(bones_[b]);
      if (look(a, b, motion)) return;
    }
  }
}

// The vertex of bone `a` that lies deepest in `b`, the first of those as deep; `more_than` where none lies
// deeper. No more is looked for once one lies deeper than `enough`.
BoneOverlaps::Depth BoneOverlaps::overlap(std::size_t a, std::size_t b, const RigidTransform& motion,
                                          double more_than, double enough) {
  const std::vector<Eigen::Vector3d>& vertex = bones_[a].vertex;
  const Bone& in = bones_[b];
  const double granted = touching(a, b);
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, vertex.size(), 256), Depth{.mm = more_than},
      [&](const auto& range, Depth deepest) {
        for (std::size_t v = range.begin(); v < range.end() && deepest.mm <= enough; ++v) {
          const double now = depth(in, motion * vertex[v], granted + deepest.mm);
          if (now - granted <= deepest.mm) continue;
          const double beyond = now - std::max(granted, depth(in, vertex[v], granted));
          if (beyond > deepest.mm) deepest = {beyond, v};
        }
        return deepest;
      },
      [](const Depth& x, const Depth& y) {
        if (x.mm != y.mm) return x.mm > y.mm ? x : y;
        return x.vertex < y.vertex ? x : y;
      });
}

BoneOverlap BoneOverlaps::deepest(std::span<const RigidTransform> segments) {
  BoneOverlap out;
  each_pair(segments, [&](std::size_t a, std::size_t b, const RigidTransform& motion) {
    const Depth here = overlap(a, b, motion, out.mm, std::numeric_limits<double>::infinity());
    if (here.mm > out.mm) out = {bones_[a].tissue, bones_[b].tissue, here.mm, bones_[a].vertex[here.vertex]};
    return false;
  });
  return out;
}

bool BoneOverlaps::meet(std::span<const RigidTransform> segments, double by_mm) {
  bool met = false;
  each_pair(segments, [&](std::size_t a, std::size_t b, const RigidTransform& motion) {
    met = overlap(a, b, motion, by_mm, by_mm).mm > by_mm;
    return met;
  });
  return met;
}

}  // namespace ecorche::runtime
