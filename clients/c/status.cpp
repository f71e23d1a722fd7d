// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "clients/c/guard.hpp"

namespace ecorche::c {
namespace {

thread_local std::array<char, 1024> last_message{};

}  // namespace

ecorche_code fail(ecorche_code code, std::string_view message) noexcept {
  const std::size_t length = std::min(message.size(), last_message.size() - 1);
  std::memcpy(last_message.data(), message.data(), length);
  last_message[length] = '\0';
  return code;
}

ecorche_code fail(const Status& status) noexcept {
  return fail(static_cast<ecorche_code>(status.code), status.message);
}

const char* last_error() noexcept {
  return last_message.data();
}

}  // namespace ecorche::c
