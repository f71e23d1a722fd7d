// SPDX-License-Identifier: Apache-2.0
// libFuzzer's way in to the target that the environment names: one executable for all, as linking takes
// longest.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "tests/fuzz/targets.hpp"

namespace {

const ecorche::fuzz::Target& chosen() {
  const char* const name = std::getenv("ECORCHE_FUZZ_TARGET");
  for (const ecorche::fuzz::Target& target : ecorche::fuzz::targets) {
    if (name != nullptr && name == std::string_view(target.name)) return target;
  }
  std::fputs("error: ECORCHE_FUZZ_TARGET names no target (see scripts/fuzz --help)\n", stderr);
  std::exit(64);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const ecorche::fuzz::Target& target = chosen();
  target.run(std::as_bytes(std::span(data, size)));
  return 0;
}
