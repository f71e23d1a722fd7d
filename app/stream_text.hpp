// SPDX-License-Identifier: Apache-2.0
// The report of `ecorche stream` for people.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace ecorche::app {

/// Of the report in JSON; `model`: the file that frames were checked against, where they were.
std::string stream_text(const nlohmann::json& report, const std::string& model);

}  // namespace ecorche::app
