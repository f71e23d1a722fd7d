// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/recording_file.hpp"

#include <string>
#include <utility>

#include "runtime/server/resources/guarded.hpp"

namespace ecorche::server {

std::filesystem::path RecordingFile::part_of(const std::filesystem::path& path) {
  return path.string() + ".part";
}

RecordingFile::RecordingFile(std::filesystem::path path) : path_(std::move(path)), part_(part_of(path_)) {}

void RecordingFile::fail(const char* what, const std::error_code& error) noexcept {
  try {
    status_ = {StatusCode::resource_exhausted, "record: its file cannot be " + std::string(what) + ": " +
                                                   error.message() + " (ask who runs the server)"};
  } catch (const std::exception&) {
    status_ = {StatusCode::resource_exhausted, "out of memory"};
  }
}

void RecordingFile::append(std::string_view bytes) noexcept {
  expected_ -= bytes.size();
  if (!status_.ok() || bytes.empty()) return;
  std::error_code error;
  if (!file_.is_open()) {
    file_ = platform::File(part_, platform::Open::make_to_append, error);
    if (error) return fail("made", error);
  }
  file_.write(bytes, error);
  if (error) fail("written", error);
}

Status RecordingFile::commit() noexcept {
  return guarded("record", [&]() -> Status {
    if (!status_.ok()) return status_;
    if (const std::error_code error = file_.flush()) {
      fail("flushed", error);
      return status_;
    }
    std::error_code ec;
    if (std::filesystem::exists(path_, ec)) {
      return {StatusCode::already_exists, "record: there is a recording of this name (choose another)"};
    }
    std::filesystem::rename(part_, path_, ec);
    if (ec) fail("renamed", ec);
    return status_;
  });
}

}  // namespace ecorche::server
