// SPDX-License-Identifier: Apache-2.0
// libFuzzer's way in to the target that the environment names: one executable for all, as linking takes
// longest.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

#include "tests/fuzz/frame_mutator.hpp"
#include "tests/fuzz/targets.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

namespace ecorche::fuzz {
namespace {

const Target& chosen() {
  const char* const name = std::getenv("ECORCHE_FUZZ_TARGET");
  for (const Target& target : targets) {
    if (name != nullptr && name == std::string_view(target.name)) return target;
  }
  std::fputs("error: ECORCHE_FUZZ_TARGET names no target (see scripts/fuzz --help)\n", stderr);
  std::exit(64);
}

Form chosen_form() {
  static const Form form = form_of(chosen().name);
  return form;
}

std::string change_bytes(std::string bytes, std::size_t most) {
  const std::size_t size = bytes.size();
  bytes.resize(std::max(size, most));
  bytes.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(bytes.data()), size, bytes.size()));
  return bytes;
}

std::string text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

std::size_t give(const std::string& bytes, std::uint8_t* out) {
  std::memcpy(out, bytes.data(), bytes.size());
  return bytes.size();
}

}  // namespace
}  // namespace ecorche::fuzz

using namespace ecorche::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Target& target = chosen();
  target.run(std::as_bytes(std::span(data, size)));
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most,
                                               unsigned seed) {
  return give(mutate_frames(chosen_form(), text_of(data, size), most, seed, change_bytes), data);
}

extern "C" std::size_t LLVMFuzzerCustomCrossOver(const std::uint8_t* a, std::size_t a_size,
                                                 const std::uint8_t* b, std::size_t b_size, std::uint8_t* out,
                                                 std::size_t most, unsigned seed) {
  return give(cross_frames(chosen_form(), text_of(a, a_size), text_of(b, b_size), most, seed), out);
}
