// SPDX-License-Identifier: Apache-2.0
#include "core/files/hidden_beside.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>

#include "core/platform/process.hpp"
#include "core/values/text.hpp"

namespace ecorche::files {

std::filesystem::path hidden_beside(const std::filesystem::path& path, std::error_code& error) {
  std::array<std::byte, sizeof(std::uint64_t)> guess{};
  error = platform::fill_random(guess);
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  return folder / ("." + std::to_string(platform::process_id()) + "." +
                   text::hex(std::bit_cast<std::uint64_t>(guess)) + ".part." + path.filename().string());
}

}  // namespace ecorche::files
