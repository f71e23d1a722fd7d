// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdlib>
#include <string>

#include "app/cli.hpp"

namespace ecorche::app {

/// The first value given to an option of numbers that is a NaN, else null: no comparison with it holds, so no
/// range keeps it out.
inline const std::string* nan_value(const CLI::Option& option) {
  if (option.get_type_name().find("FLOAT") == std::string::npos) return nullptr;
  for (const std::string& value : option.results()) {
    if (std::isnan(std::strtod(value.c_str(), nullptr))) return &value;
  }
  return nullptr;
}

}  // namespace ecorche::app
