// SPDX-License-Identifier: Apache-2.0
// What finite elements make of each joint alone, kept as fields that are added to skinning.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include <ecorche/preprocess/stage_store.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::correct {

struct CalibrateOptions {
  std::vector<std::string> joints;  ///< names of those that are sampled; all where there are none
  double step_deg = 15;             ///< between samples of a hinge, at most
  double least_mm = 0.05;           ///< smaller displacements are not kept
  double least_share = 1e-3;        ///< of weights: see neighbourhood
  /// Of the tets that skinning leaves inside out: so many may be in a sample. Without any a correction ends
  /// where the first tet folds, at hips and elbows half way.
  double folds = 0.5;
  double poisson = 0.45;  ///< linear tets lock beyond
};

/// Of one sample that was solved.
struct SampleReport {
  Eigen::Vector3d from_rest;  ///< radians, along the joint's sequence
  bool clean = false;
  std::size_t inverted = 0, by_skinning = 0;  ///< tets of the neighbourhood
  int iterations = 0;
};

/// Of one joint.
struct JointReport {
  std::string joint;
  std::size_t tets = 0, free_nodes = 0;  ///< of its neighbourhood
  std::size_t samples = 0, clean = 0;    ///< solved, and kept
  double clean_deg = 0;                  ///< the largest turn of a sample that is kept
  std::vector<SampleReport> tried;
  std::size_t nodes = 0, modes = 0, bytes = 0;  ///< of the correction
  double mean_mm = 0, max_mm = 0;               ///< of it, over its nodes, at the sample that moves most
};

/// Fills in what a correction says itself: from clean_deg on, but for `tried`.
void report_on(const JointCorrection& correction, JointReport& report);

struct Calibration {
  std::vector<JointCorrection> corrections;  ///< joints without any are left out
  std::vector<JointReport> joints;
};

/// Samples of all joints that turn by themselves, several joints at a time; `store` keeps each solved one, so
/// that an interrupted run goes on where it ended. Of a chain of samples those behind the first that is not
/// clean are not asked for; between it and the one before, one or two more are. Same result for any number of
/// threads, and whatever the store held. Throws Error{usage} for a name that is no joint that turns.
Calibration calibrate(const Model& model, const CalibrateOptions& options, preprocess::StageStore* store,
                      const Context& context);

}  // namespace ecorche::correct
