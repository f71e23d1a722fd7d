// SPDX-License-Identifier: Apache-2.0
// All of the preparation, in order: rig, voxels, tets, weights, centres, mapping, certificate.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/values/case.hpp"
#include "core/values/context.hpp"
#include "core/values/model.hpp"

namespace ecorche::preprocess {

struct Options {
  std::string mesher;            ///< empty: the build's default
  double voxel_mm = 0;           ///< 0: see voxel::Options
  std::int64_t max_tets = 3'500'000;
  std::int64_t max_nodes = 800'000;
  std::string solver = "auto";
  double cor_sigma = 0.05;
};

struct StageTime {
  std::string name;
  double seconds = 0;
  double peak_rss_mib = 0;  ///< of the process, at the end of the stage
};

struct Result {
  Model model;
  std::vector<StageTime> stages;
  std::vector<std::string> warnings;
};

/// `on_stage(name, index, count)` is called as each stage starts (may be empty).
using StageCallback = std::function<void(std::string_view name, int index, int count)>;

/// Deterministic: the same case and options give the same model whatever the number of threads.
Result run(const Case& patient, const Options& options, const Context& context, const StageCallback& on_stage);

/// Certificate of a model, measured on what is stored; members that only the solver knows are copied from `model`.
Certificate measure(const Model& model, const Context& context);

/// The bounds that a certificate must keep (DESIGN 7); empty when it does, else one line per broken bound.
std::vector<std::string> broken_bounds(const Certificate& certificate);

}  // namespace ecorche::preprocess
