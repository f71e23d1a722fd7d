// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "clients/c/guard.hpp"
#include "core/values/utf8.hpp"

namespace ecorche::c {
namespace {

thread_local std::array<char, 1024> last_message{};

}  // namespace

ecorche_code fail(ecorche_code code, std::string_view message) noexcept {
  std::size_t length = 0;
  while (!message.empty()) {
    // A caller's name may be no text.
    const std::size_t size = text::first_character(message).second;
    const std::string_view next = size > 0 ? message.substr(0, size) : "?";
    if (length + next.size() >= last_message.size()) break;
    std::copy(next.begin(), next.end(), last_message.begin() + static_cast<std::ptrdiff_t>(length));
    length += next.size();
    message.remove_prefix(std::max<std::size_t>(size, 1));
  }
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
