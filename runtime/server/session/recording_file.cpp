// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/recording_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "runtime/server/resources/guarded.hpp"

namespace ecorche::server {

std::filesystem::path RecordingFile::part_of(const std::filesystem::path& path) {
  return path.string() + ".part";
}

RecordingFile::RecordingFile(std::filesystem::path path) : path_(std::move(path)), part_(part_of(path_)) {}

RecordingFile::~RecordingFile() {
  if (file_ >= 0) ::close(file_);
}

void RecordingFile::fail(const char* what) noexcept {
  const int error = errno;
  try {
    status_ = {StatusCode::resource_exhausted, "record: its file cannot be " + std::string(what) + ": " +
                                                   std::strerror(error) + " (ask who runs the server)"};
  } catch (const std::exception&) {
    status_ = {StatusCode::resource_exhausted, "out of memory"};
  }
}

void RecordingFile::append(std::string_view bytes) noexcept {
  expected_ -= bytes.size();
  if (!status_.ok() || bytes.empty()) return;
  if (file_ < 0) {
    constexpr int kReadable = 0644;
    file_ = ::open(part_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_APPEND | O_CLOEXEC, kReadable);
    if (file_ < 0) return fail("made");
  }
  while (!bytes.empty()) {
    const ssize_t written = ::write(file_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return fail("written");
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

Status RecordingFile::commit() noexcept {
  return guarded("record", [&]() -> Status {
    if (!status_.ok()) return status_;
    if (::fsync(file_) != 0) {
      fail("flushed");
      return status_;
    }
    std::error_code ec;
    if (std::filesystem::exists(path_, ec)) {
      return {StatusCode::already_exists, "record: there is a recording of this name (choose another)"};
    }
    if (::rename(part_.c_str(), path_.c_str()) != 0) fail("renamed");
    return status_;
  });
}

}  // namespace ecorche::server
