// SPDX-License-Identifier: Apache-2.0
#include <ecorche/values/error.hpp>
#include "core/model_file/guard.hpp"

namespace ecorche::model_file {

InputFile::InputFile(const std::filesystem::path& path) : name_(path.string()) {
  std::error_code error;
  file_ = platform::File(path, platform::Open::read, error);
  if (error) {
    throw Error(ErrorKind::missing_input, name_, "cannot be opened: " + error.message(),
                "check the path and its rights");
  }
  size_ = file_.size(error);
  if (error || !file_.is_regular())
    throw Error(ErrorKind::missing_input, name_, "is not a regular file", "name a model file");
}

void InputFile::read(std::uint64_t offset, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    std::error_code error;
    const std::size_t got = file_.read_at(offset, bytes, error);
    if (got == 0) {
      throw Error(ErrorKind::io, name_,
                  error ? "reading failed: " + error.message() : "became shorter meanwhile",
                  "check the disk");
    }
    offset += got;
    bytes = bytes.subspan(got);
  }
}

}  // namespace ecorche::model_file
