// SPDX-License-Identifier: Apache-2.0
// What `verify` and `preprocess` say of a model under --json.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>

#include <ecorche/values/model.hpp>

namespace ecorche::app {

/// {"ok", "nodes", "tets", "segments", "weights", "mesh", "tissues", "bones", "digests"}: counts of `model`
/// (null: it could not be read, and what it would have said is null), figures of `certificate`, digests
/// looked at and found bad.
nlohmann::json model_report(bool ok, const Model* model, const Certificate& certificate, std::size_t checked,
                            std::size_t bad);

}  // namespace ecorche::app
