// SPDX-License-Identifier: Apache-2.0
// What is against a posed body, in words: which figure, by how much, where, and what to do.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::app {

/// How the body was posed, which decides what there is left to try.
struct HowPosed {
  runtime::Skinning skinning = runtime::Skinning::cor;
  bool settled = false;  ///< by --settle, or to the end by finite elements
  bool by_tets = true;   ///< else by spheres, which nothing settles
};

/// `warnings` of quality.json, one object for each breach of a threshold, the worst tissues first. `det_f`:
/// of every tet (runtime::tet_det_f).
nlohmann::json warnings_json(const Model& model, const runtime::PosedBody& body,
                             const runtime::PoseQuality& quality, std::span<const float> det_f,
                             const HowPosed& how);

/// `clamped` of quality.json: joints with what their limits took away, and which limits these are.
nlohmann::json clamped_json(const Skeleton& skeleton, const Pose& pose,
                            std::span<const ClampedJoint> clamped);

}  // namespace ecorche::app
