// SPDX-License-Identifier: Apache-2.0
#include "core/platform/process.hpp"

#include <signal.h>
#include <sys/random.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <string>

namespace ecorche::platform {

int process_id() {
  return ::getpid();
}

bool process_exists(int id) {
  return ::kill(id, 0) == 0 || errno != ESRCH;
}

std::uint64_t peak_memory_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word != "VmHWM:") continue;
    std::uint64_t kib = 0;
    status >> kib;
    return kib << 10;
  }
  return 0;
}

std::filesystem::path own_program() {
  return "/proc/self/exe";
}

std::error_code fill_random(std::span<std::byte> out) {
  if (::getrandom(out.data(), out.size(), 0) == static_cast<::ssize_t>(out.size())) return {};
  return {errno, std::generic_category()};
}

}  // namespace ecorche::platform
