// SPDX-License-Identifier: Apache-2.0
#include "runtime/quality/overlap_meter.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <unordered_set>
#include <utility>

#include "runtime/quality/bone_overlaps.hpp"
#include "runtime/quality/depth_grid.hpp"
#include "runtime/quality/shared_joint.hpp"

namespace ecorche::runtime {
namespace {

constexpr double kNearJointMm = 25, kNearMm = 10;
constexpr float kPointsMm = 3;
constexpr double kSpacingMm = 3;
constexpr double kPairCells = 16384;  // of a grid

// The first in each cube.
std::vector<Eigen::Vector3f> thinned(const PointsF& V) {
  std::unordered_set<std::uint64_t> taken;
  std::vector<Eigen::Vector3f> out;
  for (Eigen::Index v = 0; v < V.rows(); ++v) {
    std::uint64_t cube = 0;
    for (int c = 0; c < 3; ++c) {
      const auto at = static_cast<std::int64_t>(std::floor(V(v, c) / kPointsMm));
      cube = cube << 21U | (static_cast<std::uint64_t>(at) & 0x1fffffU);
    }
    if (taken.insert(cube).second) out.emplace_back(V.row(v).transpose());
  }
  return out;
}

RigidTransform motion_against(std::span<const RigidTransform> segments, std::int32_t of, std::int32_t in) {
  return segments[static_cast<std::size_t>(in)].inverse() * segments[static_cast<std::size_t>(of)];
}

Eigen::AlignedBox3d grown(const Eigen::AlignedBox3d& box, double mm) {
  const Eigen::Vector3d by = Eigen::Vector3d::Constant(mm);
  return {box.min() - by, box.max() + by};
}

}  // namespace

// A bone's points in another one's grid.
struct OverlapMeter::Pair {
  struct Point {
    Eigen::Vector3f rest;
    float granted = 0;  // mm that it may lie in the other bone
  };
  const Bone* of = nullptr;
  std::vector<Point> points;
  DepthGrid grid;  // where the other bone is near this one

  void grant_what_touches() {
    float touching = 0;
    for (Point& p : points) {
      p.granted = grid.depth(p.rest);
      touching = std::max(touching, p.granted);
    }
    touching = std::min(touching, static_cast<float>(kTouchingMm));
    for (Point& p : points) p.granted = std::max(p.granted, touching);
  }
};

struct OverlapMeter::Bone {
  std::size_t tissue = 0;
  std::int32_t segment = 0;
  std::vector<Eigen::Vector3f> points;
  Eigen::AlignedBox3d box;
  std::vector<std::pair<const Bone*, double>> near;  // bones that it meets within so many mm
  mutable std::once_flag made;
  mutable std::vector<Pair> pairs;  // bones in this one
  mutable std::atomic<bool> prepared = false;

  Bone(const Tissue& of, std::size_t row) : tissue(row), segment(of.segment), points(thinned(of.V)) {
    for (Eigen::Index v = 0; v < of.V.rows(); ++v) box.extend(of.V.row(v).cast<double>().transpose());
  }
};

OverlapMeter::OverlapMeter(const Model& model) : model_(model) {
  for (std::size_t t = 0; t < model.tissues.size(); ++t) {
    const Tissue& tissue = model.tissues[t];
    if (tissue.segment != Tissue::by_tets && tissue.F.rows() > 0)
      bones_.push_back(std::make_unique<Bone>(tissue, t));
  }
  for (const auto& in : bones_) {
    for (const auto& of : bones_) {
      if (of->segment == in->segment) continue;
      const double mm = share_joint(model.rig.skeleton, of->segment, in->segment) ? kNearJointMm : kNearMm;
      if (grown(in->box, mm).intersects(of->box)) in->near.emplace_back(of.get(), mm);
    }
  }
}

OverlapMeter::~OverlapMeter() = default;

std::vector<OverlapMeter::Pair> OverlapMeter::make_pairs(const Bone& in) const {
  const Tissue& tissue = model_.tissues[in.tissue];
  const SurfaceTrees trees(SurfaceMesh{tissue.V.cast<double>(), tissue.F});  // large: not kept
  std::vector<Pair> out;
  for (const auto& [of, mm] : in.near) {
    Pair pair{of, {}, {}};
    Eigen::AlignedBox3d region;
    const Eigen::AlignedBox3d about = grown(in.box, mm);
    std::int32_t hint = -1;
    for (const Eigen::Vector3f& p : of->points) {
      if (!about.contains(p.cast<double>())) continue;
      const geometry::FaceTree::Hit hit = trees.faces.nearest(p.cast<double>(), hint);
      hint = hit.face;
      if (hit.squared > mm * mm) continue;
      pair.points.push_back({p, 0});
      region.extend(hit.point);
    }
    if (pair.points.empty()) continue;
    region = grown(region, kNearMm).intersection(in.box);
    pair.grid = DepthGrid(trees, region, std::max(kSpacingMm, std::cbrt(region.volume() / kPairCells)));
    pair.grant_what_touches();
    out.push_back(std::move(pair));
  }
  return out;
}

// While it waits for its own loops, the thread must not take up another job: that one could want the same.
const std::vector<OverlapMeter::Pair>& OverlapMeter::pairs_into(const Bone& in) const {
  std::call_once(in.made, [&] {
    tbb::this_task_arena::isolate([&] { in.pairs = make_pairs(in); });
    in.prepared = true;
  });
  return in.pairs;
}

void OverlapMeter::prepare(std::size_t tissue) const {
  for (const auto& in : bones_)
    if (in->tissue == tissue && !in->near.empty()) pairs_into(*in);
}

// Whether something moves against the bone.
bool OverlapMeter::asked(const Bone& in, std::span<const RigidTransform> segments) {
  return std::any_of(in.near.begin(), in.near.end(), [&](const auto& near) {
    return !stands_still(motion_against(segments, near.first->segment, in.segment));
  });
}

std::optional<BoneOverlap> OverlapMeter::deepest_if_prepared(std::span<const RigidTransform> segments) const {
  const auto lacks = [&](const auto& in) { return !in->prepared && asked(*in, segments); };
  if (std::any_of(bones_.begin(), bones_.end(), lacks)) return std::nullopt;
  return deepest(segments);
}

BoneOverlap OverlapMeter::deepest(std::span<const RigidTransform> segments) const {
  const auto in_one = [&](const Bone& in) {
    BoneOverlap deepest;
    if (!asked(in, segments)) return deepest;
    for (const Pair& pair : pairs_into(in)) {
      const RigidTransform motion = motion_against(segments, pair.of->segment, in.segment);
      if (stands_still(motion)) continue;
      const Eigen::Matrix3f turn = motion.q.toRotationMatrix().cast<float>();
      const Eigen::Vector3f shift = motion.t.cast<float>();
      for (const Pair::Point& p : pair.points) {
        const float mm = pair.grid.depth(turn * p.rest + shift) - p.granted;
        if (static_cast<double>(mm) > deepest.mm)
          deepest = {pair.of->tissue, in.tissue, static_cast<double>(mm), p.rest.cast<double>()};
      }
    }
    return deepest;
  };
  std::vector<BoneOverlap> found(bones_.size());
  tbb::parallel_for(std::size_t{0}, bones_.size(), [&](std::size_t b) { found[b] = in_one(*bones_[b]); });
  BoneOverlap out;
  for (const BoneOverlap& one : found)
    if (one.mm > out.mm) out = one;
  return out;
}

}  // namespace ecorche::runtime
