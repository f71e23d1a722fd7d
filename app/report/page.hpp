// SPDX-License-Identifier: Apache-2.0
// The report of a preparation: one page that needs nothing else.
#pragma once

#include <string>
#include <vector>

#include <ecorche/preprocess/pipeline.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::app::report {

struct Input {
  const Model& model;
  const std::vector<preprocess::StageTime>& stages;
  const std::vector<std::string>& warnings;  ///< of reading and of the pipeline, in their order
  std::string more = {};                     ///< a section behind the rig, as HTML
};

/// HTML 5 with style and pictures inside, no script, no link: certificate beside its bounds, slices with
/// bones and weights, the rig, where limbs were cut free, histograms of the mesh's and the weights' quality,
/// times, warnings with pictures of where they are, provenance. Without the `times` the same model gives the
/// same page.
std::string page(const Input& input);

}  // namespace ecorche::app::report
