// SPDX-License-Identifier: Apache-2.0
// What goes wrong on a thread that must not throw.
#pragma once

#include <exception>
#include <new>
#include <string>
#include <utility>

#include <ecorche/values/error.hpp>

namespace ecorche::server {

/// Calls `work`, which returns a Status; what it throws comes back as one. Without memory, be it only for the
/// words, the status says that `what` failed for it, or "out of memory" alone, which strings hold in
/// themselves.
template <class Work>
Status guarded(const char* what, Work&& work) noexcept {
  try {
    try {
      return std::forward<Work>(work)();
    } catch (const Error& error) {
      return to_status(error);
    } catch (const std::bad_alloc&) {
      return {StatusCode::resource_exhausted,
              std::string(what) + ": the server is out of memory (ask for less)"};
    } catch (const std::exception& error) {
      return {StatusCode::internal, error.what()};
    }
  } catch (const std::exception&) {
    return {StatusCode::resource_exhausted, "out of memory"};
  }
}

}  // namespace ecorche::server
