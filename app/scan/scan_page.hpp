// SPDX-License-Identifier: Apache-2.0
// `new --report`: what each label became, as one page that needs nothing else.
#pragma once

#include <string>

#include "app/scan/scan_case.hpp"

namespace ecorche::app {

/// HTML 5 with its style and pictures inside, no script, no link, readable on a phone.
std::string scan_page(const ScanCase& scan, const std::string& name);

}  // namespace ecorche::app
