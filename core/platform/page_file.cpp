// SPDX-License-Identifier: Apache-2.0
#include "core/platform/page_file.hpp"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <utility>

#include "core/platform/last_error.hpp"

namespace ecorche::platform {
namespace {

constexpr mode_t kWriting = 0600, kSealed = 0400, kWrite = 0222, kOthersWrite = 0022;

std::error_code untrusted() {
  return std::make_error_code(std::errc::permission_denied);
}

bool lock(int descriptor, int how) {
  int result = 0;
  do {
    result = ::flock(descriptor, how | LOCK_NB);
  } while (result != 0 && errno == EINTR);
  return result == 0;
}

}  // namespace

std::size_t page_bytes() noexcept {
  static const auto bytes = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return bytes;
}

std::error_code cannot_keep_pages_in(const std::filesystem::path& folder) noexcept {
  // What is looked at must be what is used: the folder itself, no link to one that may be turned elsewhere.
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor < 0) return last_error();
  struct stat status {};
  struct statfs system {};
  std::error_code error;
  if (::fstat(descriptor, &status) != 0 || ::fstatfs(descriptor, &system) != 0)
    error = last_error();
  else if (status.st_uid != ::geteuid() || (status.st_mode & kOthersWrite) != 0)
    error = untrusted();
  else if (system.f_type != TMPFS_MAGIC && system.f_type != RAMFS_MAGIC)
    error = std::make_error_code(std::errc::not_supported);
  ::close(descriptor);
  return error;
}

std::error_code make_own_folder(const std::filesystem::path& folder) noexcept {
  constexpr mode_t kOwn = 0700;
  return ::mkdir(folder.c_str(), kOwn) == 0 || errno == EEXIST ? std::error_code() : last_error();
}

std::error_code rename_to_new(const std::filesystem::path& from, const std::filesystem::path& to) noexcept {
  return ::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0 ? std::error_code()
                                                                                          : last_error();
}

PageFile::~PageFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

PageFile::PageFile(PageFile&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

PageFile& PageFile::operator=(PageFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

PageFile PageFile::make(const std::filesystem::path& path, std::error_code& error) noexcept {
  PageFile file(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, kWriting));
  error = file.is_open() ? std::error_code() : last_error();
  return file;
}

PageFile PageFile::open(const std::filesystem::path& path, std::error_code& error) noexcept {
  // Without O_NONBLOCK the opening of a pipe would wait for its writer.
  PageFile file(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct stat status {};
  if (!file.is_open() || ::fstat(file.descriptor_, &status) != 0)
    error = errno == ELOOP ? untrusted() : last_error();
  else if (!S_ISREG(status.st_mode) || status.st_uid != ::geteuid() || (status.st_mode & kOthersWrite) != 0)
    error = untrusted();
  else
    error = {};
  return error ? PageFile() : std::move(file);
}

std::uint64_t PageFile::size() const noexcept {
  struct stat status {};
  return ::fstat(descriptor_, &status) == 0 ? static_cast<std::uint64_t>(status.st_size) : 0;
}

bool PageFile::hold() noexcept {
  return lock(descriptor_, LOCK_SH);
}

bool PageFile::take_alone() noexcept {
  return lock(descriptor_, LOCK_EX);
}

bool PageFile::has_name() const noexcept {
  struct stat status {};
  return ::fstat(descriptor_, &status) == 0 && status.st_nlink > 0;
}

bool PageFile::is_at(const std::filesystem::path& path) const noexcept {
  struct stat mine {
  }, there{};
  return ::fstat(descriptor_, &mine) == 0 && ::lstat(path.c_str(), &there) == 0 &&
         mine.st_dev == there.st_dev && mine.st_ino == there.st_ino;
}

bool PageFile::is_sealed() const noexcept {
  struct stat status {};
  return ::fstat(descriptor_, &status) == 0 && (status.st_mode & kWrite) == 0;
}

std::error_code PageFile::resize(std::uint64_t bytes) noexcept {
  return ::ftruncate(descriptor_, static_cast<off_t>(bytes)) == 0 ? std::error_code() : last_error();
}

std::error_code PageFile::write_at(std::uint64_t offset, std::span<const std::byte> bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return last_error();
    offset += static_cast<std::uint64_t>(written);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return {};
}

std::error_code PageFile::seal() noexcept {
  return ::fchmod(descriptor_, kSealed) == 0 ? std::error_code() : last_error();
}

std::error_code PageFile::read_at(std::uint64_t offset, std::span<std::byte> out) const noexcept {
  while (!out.empty()) {
    const ssize_t got = ::pread(descriptor_, out.data(), out.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return last_error();
    if (got == 0) return std::make_error_code(std::errc::io_error);
    offset += static_cast<std::uint64_t>(got);
    out = out.subspan(static_cast<std::size_t>(got));
  }
  return {};
}

std::error_code PageFile::stand_at(std::uint64_t offset, std::span<const std::byte> pages) const noexcept {
  void* const at = const_cast<std::byte*>(pages.data());
  // To be written, too, as the memory was that it stands for: its allocator may use it again. Private: who
  // writes has a copy.
  if (::mmap(at, pages.size(), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_FIXED, descriptor_,
             static_cast<off_t>(offset)) == MAP_FAILED)
    return last_error();
#ifdef MADV_POPULATE_READ
  ::madvise(at, pages.size(), MADV_POPULATE_READ);  // not by the first frame, page by page; a wish
#endif
  return {};
}

}  // namespace ecorche::platform
