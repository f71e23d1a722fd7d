// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/values/error.hpp>
#include "tests/fuzz/place.hpp"
#include "tests/fuzz/targets.hpp"
#include "tests/support/toy_model.hpp"

// HDF5 1.10 itself loses a block whenever it refuses a damaged header (tests/unit/model_file/test_files.cpp).
// NOLINTBEGIN(bugprone-reserved-identifier): the name is LeakSanitizer's.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libhdf5_serial";
}
// NOLINTEND(bugprone-reserved-identifier)

namespace ecorche::fuzz {

void model(Bytes bytes) {
  static const Place place;
  static const std::string good = [] {
    model_file::leave_hdf5_open_at_exit();
    const std::filesystem::path path = place.put("model.hdf", "");
    model_file::write(test::toy_model(), path, Context{});
    std::ifstream file(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  }();
  std::string spoilt = good;
  for (; bytes.size() >= 4; bytes = bytes.subspan(4)) {
    const std::size_t offset = std::to_integer<std::size_t>(bytes[0]) << 16 |
                               std::to_integer<std::size_t>(bytes[1]) << 8 |
                               std::to_integer<std::size_t>(bytes[2]);
    spoilt[offset % spoilt.size()] = static_cast<char>(bytes[3]);
  }
  // A rest of a byte or two cuts the file there.
  if (!bytes.empty()) spoilt.resize(spoilt.size() * std::to_integer<std::size_t>(bytes[0]) / 256);
  const std::filesystem::path path = place.put("model.hdf", spoilt);
  try {
    const Model read = model_file::read(path, Context{});
    if (read.segment_count() == 0) std::abort();
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::data && error.kind() != ErrorKind::missing_input) std::abort();
  }
}

}  // namespace ecorche::fuzz
