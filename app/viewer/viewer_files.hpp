// SPDX-License-Identifier: Apache-2.0
// The viewer as it was bundled when ecorche was built.
#pragma once

#include <span>

#include "runtime/server/net/web_files.hpp"

namespace ecorche::app {

/// Empty where scripts/viewer had not been run.
std::span<const server::EmbeddedFile> viewer_files();

}  // namespace ecorche::app
