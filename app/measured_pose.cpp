// SPDX-License-Identifier: Apache-2.0
#include "app/measured_pose.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include <ecorche/runtime/verdict.hpp>
#include "runtime/settle/carry_tissues.hpp"
#include "runtime/settle/unfold.hpp"

namespace ecorche::app {
namespace {

constexpr int kSettleSteps = 120;  // in files nobody waits for the next frame: 4 to 6 s at 300 k tets

// Points that differ between `before` and `now` go to where the root takes them.
void carry(const std::vector<float>& before, const std::vector<float>& now, const RigidTransform& root,
           std::vector<float>& out) {
  for (std::size_t i = 0; i < now.size(); i += 3) {
    if (std::equal(&now[i], &now[i] + 3, &before[i])) continue;
    const Eigen::Vector3d p = root * Eigen::Map<const Eigen::Vector3f>(&now[i]).cast<double>();
    Eigen::Map<Eigen::Vector3f> there(&out[i]);
    there = p.cast<float>();
  }
}

}  // namespace

MeasuredPose::MeasuredPose(const runtime::BodyPoser& poser)
    : poser_(poser),
      body_(poser.make_frame()),
      still_(poser.make_frame()),
      closed_(runtime::closed_surfaces(poser.model())),
      overlaps_(poser.model()) {}

Status MeasuredPose::run(const Pose& pose, runtime::Skinning skinning) {
  if (Status status = poser_.run(pose, skinning, poser_.all_tissues(), body_); !status.ok()) return status;
  moved_ = !runtime::stands_still(body_);
  if (!moved_) return {};
  return poser_.run(pose, skinning, poser_.all_tissues(), still_, runtime::NodesOf::body,
                    runtime::Root::still);
}

// Changes the still body; what differs then goes along in the other one.
template <class Change>
void MeasuredPose::change(Change&& still) {
  if (!moved_) return still(body_);
  const std::vector<float> nodes = still_.nodes;
  const std::vector<std::vector<float>> tissues = still_.tissues;
  still(still_);
  const RigidTransform& root = body_.segments[0];
  carry(nodes, still_.nodes, root, body_.nodes);
  for (std::size_t t = 0; t < tissues.size(); ++t)
    carry(tissues[t], still_.tissues[t], root, body_.tissues[t]);
}

nlohmann::json MeasuredPose::unfold(const Context& context) {
  runtime::Unfolding done;
  change([&](runtime::PosedBody& body) { done = runtime::unfold(poser_.model(), body, context); });
  return {{"inverted_tets_before", done.inverted_before},
          {"inverted_rest_mm3_before", done.rest_mm3_before},
          {"squeezed_by_bones", done.held},
          {"moved_nodes", done.moved_nodes},
          {"largest_move_mm", done.largest_move_mm}};
}

nlohmann::json MeasuredPose::settle(const runtime::FleshSettler& settler, const Context& context) {
  runtime::Settled done;
  change([&](runtime::PosedBody& body) { done = settler.run(body, {.most_steps = kSettleSteps}, context); });
  return {{"steps", done.steps},
          {"came_to_rest", done.came_to_rest},
          {"energy_before_mm3", done.energy_before},
          {"energy_after_mm3", done.energy_after},
          {"moved_nodes", done.moved_nodes},
          {"largest_move_mm", done.largest_move_mm}};
}

runtime::PoseQuality MeasuredPose::measure() {
  runtime::PoseQuality out = runtime::measure(poser_.model(), still(), poser_.all_tissues(), {}, closed_);
  out.overlap = overlaps_.deepest(still().segments);
  runtime::judge(out.thresholds, out);
  return out;
}

void MeasuredPose::replace(const std::vector<float>& nodes, const std::vector<std::uint8_t>& moved) {
  change([&](runtime::PosedBody& body) {
    for (std::size_t n = 0; n < moved.size(); ++n)
      if (moved[n] != 0) std::copy_n(&nodes[3 * n], 3, &body.nodes[3 * n]);
    runtime::carry_tissues(poser_.model(), moved, body);
  });
}

}  // namespace ecorche::app
