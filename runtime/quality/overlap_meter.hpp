// SPDX-License-Identifier: Apache-2.0
// How deep a pose runs bones into each other, in a fraction of a frame.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche::runtime {

/// What BoneOverlaps, its slow twin, says, by some of the vertices, one a cube of 3 mm, and by distances that
/// are worked out once, 3 mm apart or more: up to a millimetre less, at sharp ends more. Both are had where
/// bones lie near each other in the scan: within 25 mm of those that a joint turns against them, within 10 mm
/// of others. What meets elsewhere is not seen. Made once per model; shared by any number of threads.
class OverlapMeter {
 public:
  /// `model` must outlive it. Distances to a bone are worked out when something first moves against it: up to
  /// 16 thousand for each bone that it is near, some 10 ms on one thread.
  explicit OverlapMeter(const Model& model);
  ~OverlapMeter();

  /// The two that run deepest into each other. The same for any number of threads.
  BoneOverlap deepest(std::span<const RigidTransform> segments) const;
  /// Nothing where distances that it would ask are not worked out yet.
  std::optional<BoneOverlap> deepest_if_prepared(std::span<const RigidTransform> segments) const;

  /// Works out the distances to a bone, if the tissue is one, so that no pose waits for them.
  void prepare(std::size_t tissue) const;

 private:
  struct Bone;
  struct Pair;

  static bool asked(const Bone& in, std::span<const RigidTransform> segments);
  const std::vector<Pair>& pairs_into(const Bone& in) const;
  std::vector<Pair> make_pairs(const Bone& in) const;

  const Model& model_;
  std::vector<std::unique_ptr<Bone>> bones_;
};

}  // namespace ecorche::runtime
