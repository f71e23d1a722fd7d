// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/model_file/model_file.hpp"
#include "core/values/error.hpp"
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
namespace {

// A file of this process alone, in memory where there is such a place.
class Place {
 public:
  Place() {
    const std::filesystem::path memory = "/dev/shm";
    const auto folder = std::filesystem::exists(memory) ? memory : std::filesystem::temp_directory_path();
    path_ = folder / ("ecorche_fuzz_" + std::to_string(getpid()) + ".hdf");
  }
  ~Place() { std::filesystem::remove(path_); }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace

void model(Bytes bytes) {
  static const Place place;
  static const std::string good = [] {
    model_file::write(test::toy_model(), place.path(), Context{});
    std::ifstream file(place.path(), std::ios::binary);
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
  std::ofstream(place.path(), std::ios::binary) << spoilt;
  try {
    const Model read = model_file::read(place.path(), Context{});
    if (read.segment_count() == 0) std::abort();
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::data && error.kind() != ErrorKind::missing_input) std::abort();
  }
}

}  // namespace ecorche::fuzz
