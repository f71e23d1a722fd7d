// SPDX-License-Identifier: Apache-2.0
#include "app/command.hpp"

namespace ecorche::app {

void declare_info(CLI::App&, Program&, Run&) {}

}  // namespace ecorche::app
