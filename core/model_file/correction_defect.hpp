// SPDX-License-Identifier: Apache-2.0
// What must hold of a model's corrections and safe ranges.
#pragma once

#include <optional>
#include <string>

#include <ecorche/values/model.hpp>

namespace ecorche::model_file {

struct Defect {
  std::string dataset, what;
};

/// The first thing that keeps the run time from using them: joints that do not exist or stand out of order,
/// sizes that do not agree, nodes out of range or of a bone's tets, turns that are no samples, values that
/// are not finite. Nothing where they are good. Linear in their size and the number of tets.
std::optional<Defect> first_defect_of_corrections(const Model& model);

}  // namespace ecorche::model_file
