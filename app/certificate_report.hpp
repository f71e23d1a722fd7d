// SPDX-License-Identifier: Apache-2.0
// A certificate for readers: every figure with the bound that it keeps, and why that bound.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "core/values/model.hpp"

namespace ecorche::app {

/// `[{figure, value, bound, kept, reason}]` in the certificate's order; `bound` and `reason` are null where a
/// figure is told and not judged.
nlohmann::json certificate_json(const Certificate& certificate);

/// The same as a table, a line a figure.
std::string certificate_text(const Certificate& certificate);

}  // namespace ecorche::app
