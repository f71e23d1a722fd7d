// SPDX-License-Identifier: Apache-2.0
// The edge of the C ABI: nothing is thrown across it, and structs of other versions are read and filled.
#pragma once

#include <algorithm>
#include <cstring>
#include <exception>
#include <new>
#include <string_view>

#include <ecorche/ecorche.h>
#include <ecorche/values/error.hpp>

namespace ecorche::c {

/// Keeps the message for ecorche_error_message; cut where it is longer than a kilobyte. Allocates nothing.
ecorche_code fail(ecorche_code code, std::string_view message) noexcept;
ecorche_code fail(const Status& status) noexcept;
/// What was kept last on this thread.
const char* last_error() noexcept;

/// What `work` returns, or what it throws as a code.
template <class Work>
ecorche_code guarded(const Work& work) noexcept {
  try {
    return work();
  } catch (const Error& error) {
    return fail(to_status(error));
  } catch (const std::bad_alloc&) {
    return fail(ECORCHE_RESOURCE_EXHAUSTED, "no memory left (close other programs, or open a smaller model)");
  } catch (const std::exception& error) {
    return fail(ECORCHE_INTERNAL, error.what());
  } catch (...) {
    return fail(ECORCHE_INTERNAL, "an error of an unknown kind");
  }
}

/// `from` into the caller's struct, which may be older and shorter.
template <class T>
ecorche_code fill(T* out, T from) noexcept {
  if (out == nullptr || out->struct_size < sizeof(std::size_t))
    return fail(ECORCHE_INVALID_ARGUMENT,
                "out: is null, or its struct_size is not set (begin with the _INIT macro)");
  from.struct_size = out->struct_size;
  std::memcpy(out, &from, std::min(out->struct_size, sizeof(T)));
  return ECORCHE_OK;
}

/// The caller's struct, with `defaults` where it is older and shorter; a null one is the defaults.
template <class T>
T read(const T* given, T defaults) noexcept {
  if (given != nullptr) std::memcpy(&defaults, given, std::min(given->struct_size, sizeof(T)));
  return defaults;
}

}  // namespace ecorche::c
