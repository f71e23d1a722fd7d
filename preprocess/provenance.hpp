// SPDX-License-Identifier: Apache-2.0
// What a model says of how it was made.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include <ecorche/preprocess/pipeline.hpp>
#include <ecorche/values/case.hpp>

namespace ecorche::preprocess {

/// Options, the mesher and solver that were used, versions of ecorche and of the libraries that shaped the
/// result, and the XXH64 of every input file (`input/PATH`, 16 hexadecimal digits). No times, nothing of the
/// machine, and nothing that depends on the number of threads.
std::map<std::string, std::string> provenance(const Case& patient, const Options& options,
                                              std::string_view mesher, std::string_view solver,
                                              double voxel_mm);

}  // namespace ecorche::preprocess
