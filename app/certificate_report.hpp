// SPDX-License-Identifier: Apache-2.0
// A certificate for readers: every figure with the bound that it keeps, and why that bound.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "preprocess/bounds.hpp"

namespace ecorche::app {

/// `[{figure, value, bound, least, most, kept, reason}]` in the certificate's order; `bound` and `reason` are
/// null where a figure is told and not judged, `least` and `most` are what the bound says of this body.
nlohmann::json certificate_json(const Certificate& certificate, const preprocess::BodySize& size);

/// The same as a table, a line a figure.
std::string certificate_text(const Certificate& certificate, const preprocess::BodySize& size);

}  // namespace ecorche::app
