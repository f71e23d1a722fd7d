// SPDX-License-Identifier: Apache-2.0
// What the handles of ecorche.h are.
#pragma once

#include <tbb/task_arena.h>

#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <ecorche/ecorche.h>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/runtime/probe.hpp>
#include <ecorche/runtime/quality_meter.hpp>
#include <ecorche/runtime/verdict.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include <ecorche/values/model.hpp>
#include "clients/c/edited_pose.hpp"
#include "runtime/quality/bone_overlaps.hpp"
#include "runtime/spheres/pose_volume.hpp"

namespace ecorche::c {

/// Made by whoever needs it first; then shared.
template <class T>
class Lazy {
 public:
  template <class Make>
  const T& get(const Make& make) const {
    std::call_once(once_, [&] { value_ = make(); });
    return *value_;
  }

 private:
  mutable std::once_flag once_;
  mutable std::unique_ptr<const T> value_;
};

/// Of one model, for bodies of any threads, one at a time: what they find out about its bones stays.
class SharedOverlaps {
 public:
  explicit SharedOverlaps(const Model& model) : overlaps_(model) {}

  runtime::BoneOverlap deepest(std::span<const RigidTransform> segments) const {
    const std::lock_guard lock(mutex_);
    // While it waits for its own loops, the thread must not take up another body's measure.
    return tbb::this_task_arena::isolate([&] { return overlaps_.deepest(segments); });
  }

 private:
  mutable std::mutex mutex_;
  mutable runtime::BoneOverlaps overlaps_;
};

struct OpenModel {
  std::shared_ptr<const Model> model;
  runtime::BodyPoser poser;
  std::uint64_t identity = 0;
  std::vector<AngleRow> angles;

  Lazy<runtime::QualityMeter> meter;
  Lazy<std::vector<std::uint8_t>> closed;
  SharedOverlaps overlaps{*model};
  Lazy<runtime::VolumePoser> volumes;
  Lazy<runtime::Probe> probe;

  explicit OpenModel(std::shared_ptr<const Model> of);
  const Skeleton& skeleton() const { return model->rig.skeleton; }
};

/// Throws Error{usage} for a row that is not there.
const ModelVolume& volume_at(const OpenModel& open, std::uint32_t row);

}  // namespace ecorche::c

struct ecorche_model {
  std::shared_ptr<const ecorche::c::OpenModel> open;
};

struct ecorche_pose {
  std::shared_ptr<const ecorche::c::OpenModel> open;
  ecorche::c::EditedPose edited;
};

struct ecorche_spheres {
  std::shared_ptr<const ecorche::c::OpenModel> open;
  std::shared_ptr<const ecorche::VolumetricSkeleton> skeleton;
  std::vector<float> radii;  ///< mm
  /// One a volume.
  std::unique_ptr<ecorche::c::Lazy<ecorche::runtime::VolumeBalls>[]> balls;
};

struct ecorche_body {
  std::shared_ptr<const ecorche::c::OpenModel> open;
  ecorche::runtime::PosedBody posed;
  std::vector<std::uint32_t> tissues;  ///< that the last update posed; room for all
  std::optional<tbb::task_arena> arena;

  ecorche::runtime::PoseQuality quality;
  std::vector<ecorche::runtime::Breach> reasons;

  ecorche::Image volume;
  ecorche::runtime::VolumePoser::Scratch volume_scratch;
  ecorche::Image refilled;
  ecorche::runtime::Probe::PosedTree tree;
  bool tree_follows = false;
  ecorche::runtime::Probed probed;

  /// Runs `work` with as many threads as the body has.
  template <class Work>
  void run(const Work& work) {
    if (arena)
      arena->execute(work);
    else
      work();
  }
};
