// SPDX-License-Identifier: Apache-2.0
// libFuzzer's way in to one target: ECORCHE_FUZZ_TARGET.
#include <cstdint>

#include "tests/fuzz/targets.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ecorche::fuzz::ECORCHE_FUZZ_TARGET(std::as_bytes(std::span(data, size)));
  return 0;
}
