// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string_view>

#include "preprocess/check/inspect_case.hpp"

namespace ecorche::check {

std::string_view severity_name(Severity severity) {
  switch (severity) {
    case Severity::note:
      return "note";
    case Severity::warning:
      return "warning";
    case Severity::error:
      break;
  }
  return "error";
}

bool Report::possible() const {
  return std::none_of(findings.begin(), findings.end(),
                      [](const Finding& f) { return f.severity == Severity::error; });
}

}  // namespace ecorche::check
