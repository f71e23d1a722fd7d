// SPDX-License-Identifier: Apache-2.0
// What `verify` and `preprocess` say of a model under --json (DESIGN 7).
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "core/model_file/model_file.hpp"
#include "core/values/model.hpp"

namespace ecorche::app {

/// {"ok", "nodes", "tets", "segments", "weights", "mesh", "tissues", "bones", "digests"} from the model's
/// certificate and what was found of the digests. `ok`: every bound holds and every digest is good.
nlohmann::json model_report(const Model& model, const std::vector<model_file::DigestCheck>& digests);

}  // namespace ecorche::app
