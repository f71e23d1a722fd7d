// SPDX-License-Identifier: Apache-2.0
// Names of CLI11, for headers: only who declares options needs the library (app/cli.hpp).
#pragma once

namespace CLI {
class App;
class Option;
}  // namespace CLI
