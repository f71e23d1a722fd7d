// SPDX-License-Identifier: Apache-2.0
#include "core/platform/file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "core/platform/last_error.hpp"

namespace ecorche::platform {
namespace {

int flags_of(Open how) {
  switch (how) {
    case Open::read:
      return O_RDONLY | O_NONBLOCK;  // without it the opening of a pipe waits for its writer
    case Open::write:
      return O_WRONLY;
    case Open::write_or_make:
      return O_WRONLY | O_CREAT;
    case Open::make:
      return O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW;
    case Open::make_to_append:
      return O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_APPEND;
  }
  return O_RDONLY;
}

}  // namespace

File::File(const std::filesystem::path& path, Open how, std::error_code& error) noexcept {
  constexpr mode_t kByMask = 0666, kOthersRead = 0644;
  descriptor_ =
      ::open(path.c_str(), flags_of(how) | O_CLOEXEC, how == Open::make_to_append ? kOthersRead : kByMask);
  error = descriptor_ < 0 ? last_error() : std::error_code();
}

File::~File() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

File::File(File&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

File& File::operator=(File&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

bool File::is_regular() const noexcept {
  struct stat status {};
  return ::fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode);
}

std::uint64_t File::size(std::error_code& error) const noexcept {
  struct stat status {};
  const bool good = ::fstat(descriptor_, &status) == 0;
  error = good ? std::error_code() : last_error();
  return good ? static_cast<std::uint64_t>(status.st_size) : 0;
}

bool File::is_same(int descriptor) const noexcept {
  struct stat mine {
  }, other{};
  return ::fstat(descriptor_, &mine) == 0 && ::fstat(descriptor, &other) == 0 &&
         mine.st_dev == other.st_dev && mine.st_ino == other.st_ino;
}

std::size_t File::read_at(std::uint64_t offset, std::span<std::byte> out,
                          std::error_code& error) const noexcept {
  ssize_t got = 0;
  do {
    got = ::pread(descriptor_, out.data(), out.size(), static_cast<off_t>(offset));
  } while (got < 0 && errno == EINTR);
  error = got < 0 ? last_error() : std::error_code();
  return got < 0 ? 0 : static_cast<std::size_t>(got);
}

void File::write(std::string_view bytes, std::error_code& error) noexcept {
  error = {};
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      error = last_error();
      return;
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

std::error_code File::reserve(std::uint64_t offset, std::uint64_t bytes) noexcept {
  return {::posix_fallocate(descriptor_, static_cast<off_t>(offset), static_cast<off_t>(bytes)),
          std::generic_category()};
}

std::error_code File::resize(std::uint64_t bytes) noexcept {
  return ::ftruncate(descriptor_, static_cast<off_t>(bytes)) == 0 ? std::error_code() : last_error();
}

std::error_code File::flush() noexcept {
  return ::fsync(descriptor_) == 0 ? std::error_code() : last_error();
}

void File::begin_flush([[maybe_unused]] std::uint64_t offset, [[maybe_unused]] std::uint64_t bytes) noexcept {
#ifdef __linux__
  ::sync_file_range(descriptor_, static_cast<off_t>(offset), static_cast<off_t>(bytes),
                    SYNC_FILE_RANGE_WRITE);
#endif
}

std::error_code flush(const std::filesystem::path& path) noexcept {
  std::error_code error;
  File file(path, Open::read, error);
  return error ? error : file.flush();
}

bool is_full(const std::error_code& error) noexcept {
  return error.category() == std::generic_category() &&
         (error.value() == ENOSPC || error.value() == EFBIG || error.value() == EDQUOT);
}

std::error_code cannot_make_in(const std::filesystem::path& folder) noexcept {
  return ::access(folder.c_str(), W_OK | X_OK) == 0 ? std::error_code() : last_error();
}

}  // namespace ecorche::platform
