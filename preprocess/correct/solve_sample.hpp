// SPDX-License-Identifier: Apache-2.0
// Finite elements about one joint, and how far they are from skinning.
#pragma once

#include <memory>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/values/pose.hpp>
#include "preprocess/correct/neighbourhood.hpp"
#include "preprocess/fem/assembly.hpp"
#include "preprocess/fem/follow.hpp"
#include "preprocess/fem/material.hpp"
#include "preprocess/fem/newton.hpp"

namespace ecorche::correct {

struct SolvedSample {
  std::uint8_t clean = 0;                            ///< converged, and no more is inverted than is allowed
  std::uint64_t inverted_tets = 0, by_skinning = 0;  ///< of the joint's neighbourhood
  std::int32_t iterations = 0;
  /// 3 * #node, mm, each in the frame that skinning turns with its node; zero for held ones. Empty where it
  /// is not clean.
  std::vector<float> displacement;
};

template <class A, class T>
requires std::same_as<std::remove_const_t<T>, SolvedSample>
void fields(A& archive, T& sample) {
  archive(sample.clean, sample.inverted_tets, sample.by_skinning, sample.iterations, sample.displacement);
}

/// A solved sample from which another begins.
struct Nearer {
  const Pose& pose;
  const std::vector<float>& displacement;
};

/// Samples of one joint. Each is solved alone: the same bits whatever was solved before it.
class SampleSolver {
 public:
  /// `model`, `part` and `material` must outlive it. `folds`: how many tets a clean sample may leave inside
  /// out, as a share of those that skinning leaves so.
  SampleSolver(const Model& model, const Neighbourhood& part, const fem::Material& material, double folds);

  /// From skinning, displaced as in `nearer`, which may be null. Where that does not end without folds, the
  /// flesh follows the joint (fem::follow) from there, or from rest; the better of both counts. Where it does
  /// not end at all, the way goes on through folds, and half a millimetre off balance is near enough.
  SolvedSample solve(const Pose& pose, const Nearer* nearer, const Context& context);

 private:
  struct Skinned {
    Points at;
    std::vector<Eigen::Quaterniond> turn;
  };
  Skinned skin(const Pose& pose) const;
  Points displaced(const Skinned& skinned, const std::vector<float>& displacement) const;
  fem::FollowResult follow(fem::StepSolver& steps, const fem::FollowOptions& way, const Nearer& from,
                           const Pose& pose, Points& x, const Context& context) const;

  const Model& model_;
  const Neighbourhood& part_;
  const fem::Material& material_;
  double folds_;
  fem::Assembly assembly_;
  std::unique_ptr<solve::SpdSolver> solver_;
};

}  // namespace ecorche::correct
