// SPDX-License-Identifier: Apache-2.0
// A posed body as it is written, and beside it as it is measured.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/values/context.hpp>
#include "runtime/quality/bone_overlaps.hpp"
#include "runtime/settle/settle_flesh.hpp"

namespace ecorche::app {

/// `body` stands where the pose takes it; `still` is the same body with its root as scanned, so that what is
/// measured of it does not lose digits to where it stands (a float32 coordinate 9 m away has steps of 1e-3
/// mm).
class MeasuredPose {
 public:
  explicit MeasuredPose(const runtime::BodyPoser& poser);

  /// Poses both, with all tissues. As BodyPoser::run.
  Status run(const Pose& pose, runtime::Skinning skinning);
  /// Unfolds both alike; what that did, as `unfolded` of quality.json.
  nlohmann::json unfold(const Context& context);

  /// Settles both alike; what that did, as `settled` of quality.json.
  nlohmann::json settle(const runtime::FleshSettler& settler, const Context& context);

  /// Puts nodes of the still body where `nodes` (3 * #nodes) has them, those with `moved`, and in both all
  /// that hangs on them.
  void replace(const std::vector<float>& nodes, const std::vector<std::uint8_t>& moved);

  /// What there is to say of the still body, by its tets, its tissues and its bones.
  runtime::PoseQuality measure();

  const runtime::BodyPoser& poser() const { return poser_; }
  const runtime::PosedBody& body() const { return body_; }
  const runtime::PosedBody& still() const { return moved_ ? still_ : body_; }

 private:
  template <class Change>
  void change(Change&& still);

  const runtime::BodyPoser& poser_;
  runtime::PosedBody body_, still_;
  bool moved_ = false;
  const std::vector<std::uint8_t> closed_;  // of the model's tissues
  runtime::BoneOverlaps overlaps_;
};

}  // namespace ecorche::app
