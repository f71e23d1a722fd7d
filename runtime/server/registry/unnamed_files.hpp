// SPDX-License-Identifier: Apache-2.0
// What clients hear of errors at the server's files.
#pragma once

#include <spdlog/spdlog.h>

#include <exception>
#include <new>
#include <string>

#include <ecorche/values/error.hpp>

namespace ecorche::server {

/// The error's code, and that what `what` and `name` say could not be done: where the file is, and what the
/// system said of it, is for the log of who runs the server. Without memory the code alone.
inline Status without_paths(const char* what, const std::string& name, const std::exception& error) noexcept {
  Status status{StatusCode::internal, {}};
  try {
    spdlog::warn("{} '{}': {}", what, name, error.what());
    const auto* const known = dynamic_cast<const Error*>(&error);
    if (known) status.code = to_status(*known).code;
    status.message = std::string(what) + " '" + name + "' (ask who runs the server: its log says why)";
  } catch (const std::bad_alloc&) {
  }
  return status;
}

}  // namespace ecorche::server
