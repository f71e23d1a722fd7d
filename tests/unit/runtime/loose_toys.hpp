// SPDX-License-Identifier: Apache-2.0
// Toys that may turn as far as they like.
#pragma once

#include <array>
#include <memory>
#include <utility>

#include <ecorche/runtime/body_poser.hpp>
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {

inline constexpr Skinning kAll[] = {Skinning::lbs, Skinning::dqs, Skinning::cor};

inline std::shared_ptr<const Model> shared(Model model) {
  return std::make_shared<const Model>(std::move(model));
}

// The toy with a ball at every joint, no limit, and its body moved to `place`.
inline Model loose_toy(const Eigen::Vector3d& place = Eigen::Vector3d::Zero()) {
  Model model = test::toy_model();
  for (Segment& segment : model.rig.skeleton.segments) {
    segment.joint.kind = JointKind::ball;
    for (AngleAxis& angle : segment.joint.sequence) angle = {angle.name, angle.axis, 1, 0};
    segment.joint.center += place;
  }
  const Eigen::RowVector3f shift = place.cast<float>().transpose();
  model.nodes.rowwise() += shift;
  model.cor.centre.rowwise() += shift;
  for (Tissue& tissue : model.tissues) tissue.V.rowwise() += shift;
  return model;
}

// The toy whose three segments overlap along the whole beam.
inline Model wide_toy() {
  Model made = loose_toy();
  Weights wide;
  wide.offsets = {0};
  for (Eigen::Index n = 0; n < made.nodes.rows(); ++n) {
    const double u = static_cast<double>(made.nodes(n, 2)) / 300;
    const std::array<double, 3> w{(1 - u) * (1 - u), 2 * u * (1 - u), u * u};
    for (std::uint16_t s = 0; s < 3; ++s) {
      if (w[s] < 1e-6) continue;
      wide.segment.push_back(s);
      wide.weight.push_back(static_cast<float>(w[s]));
    }
    wide.offsets.push_back(wide.weight.size());
  }
  made.weights = wide;
  return made;
}

}  // namespace ecorche::runtime
