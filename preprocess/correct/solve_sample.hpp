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
#include "preprocess/fem/material.hpp"
#include "preprocess/fem/newton.hpp"

namespace ecorche::correct {

struct SolvedSample {
  std::uint8_t clean = 0;  ///< converged, and no more is inverted than is allowed
  std::uint64_t inverted_tets = 0;
  std::int32_t iterations = 0;
  /// 3 * #node, mm, each in the frame that skinning turns with its node; zero for held ones. Empty where it
  /// is not clean.
  std::vector<float> displacement;
};

template <class A, class T>
requires std::same_as<std::remove_const_t<T>, SolvedSample>
void fields(A& archive, T& sample) {
  archive(sample.clean, sample.inverted_tets, sample.iterations, sample.displacement);
}

/// Samples of one joint after each other: the factor of one preconditions the next.
class SampleSolver {
 public:
  /// `model`, `part` and `material` must outlive it. `folds`: the share of the part's tets that a clean
  /// sample may leave inside out, as long as skinning leaves more.
  SampleSolver(const Model& model, const Neighbourhood& part, const fem::Material& material, double folds);

  /// `start`: displacements to begin from, as in SolvedSample, or empty: from skinning. Where that does not
  /// end clean, from rest along the joint's way (fem::follow).
  SolvedSample solve(const Pose& pose, const std::vector<float>& start, const Context& context);

 private:
  struct Skinned {
    Points at;
    std::vector<Eigen::Quaterniond> turn;
  };
  Skinned skin(const Pose& pose) const;

  const Model& model_;
  const Neighbourhood& part_;
  const fem::Material& material_;
  std::size_t most_folds_;
  fem::Assembly assembly_;
  std::unique_ptr<solve::SpdSolver> solver_;
  fem::StepSolver steps_;
};

}  // namespace ecorche::correct
