// SPDX-License-Identifier: Apache-2.0
#include "core/files/atomic_file.hpp"

#include <fcntl.h>
#include <sys/random.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include <ecorche/values/error.hpp>
#include "core/files/flush.hpp"

namespace ecorche::files {

namespace fs = std::filesystem;

namespace {

// Writers of other libraries may not tell that the disk was full: a file behind which no block fits is not
// trusted to be whole. Leaves its length alone.
int room_behind(const fs::path& path) {
  constexpr ::off_t block = 1 << 16;
  const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (file < 0) return errno;
  const ::off_t length = ::lseek(file, 0, SEEK_END);
  int error = length < 0 ? errno : ::posix_fallocate(file, length, block);
  if (length >= 0 && ::ftruncate(file, length) != 0 && error == 0) error = errno;
  ::close(file);
  return error == ENOSPC || error == EFBIG || error == EDQUOT ? error : 0;
}

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

[[noreturn]] void cannot_write(const fs::path& path) {
  throw Error(ErrorKind::cannot_create, path.string(),
              "cannot write here: " + std::string(std::strerror(errno)),
              "make the folder, or name another one");
}

// Hidden, with all extensions kept (.nii.gz): some writers choose the format by them. The process is named
// for remove_stale_parts.
fs::path hidden_beside(const fs::path& path) {
  std::uint64_t guess = 0;
  if (::getrandom(&guess, sizeof guess, 0) != static_cast<::ssize_t>(sizeof guess)) cannot_write(path);
  char digits[17];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(guess));
  return folder_of(path) /
         ("." + std::to_string(::getpid()) + "." + digits + ".part." + path.filename().string());
}

[[noreturn]] void cannot_rename(const fs::path& path, const std::error_code& error) {
  throw Error(ErrorKind::io, path.string(), "cannot rename: " + error.message(), "check the folder's rights");
}

// What stood under the names of files that are committed together, until all of them are.
class Aside {
 public:
  explicit Aside(std::span<AtomicFile* const> files) : files_(files) {}
  ~Aside() {
    std::error_code ignored;
    for (std::size_t i = 0; !done_ && i < appeared_; ++i) fs::remove(files_[i]->path(), ignored);
    for (const auto& [path, hidden] : kept_) {
      if (done_) {
        fs::remove(hidden, ignored);
      } else {
        fs::rename(hidden, path, ignored);
      }
    }
  }
  Aside(const Aside&) = delete;
  Aside& operator=(const Aside&) = delete;

  void take(const fs::path& path) {
    std::error_code error;
    const fs::file_status before = fs::symlink_status(path, error);
    if (!fs::exists(before) || fs::is_directory(before)) return;  // a folder stays, and is in the way
    const fs::path hidden = hidden_beside(path);
    fs::rename(path, hidden, error);
    if (error) cannot_rename(path, error);
    kept_.emplace_back(path, hidden);
  }
  void appear(const AtomicFile& file) {
    std::error_code error;
    fs::rename(file.temporary(), file.path(), error);
    if (error) cannot_rename(file.path(), error);
    ++appeared_;
  }
  void done() { done_ = true; }

 private:
  std::span<AtomicFile* const> files_;
  std::vector<std::pair<fs::path, fs::path>> kept_;
  std::size_t appeared_ = 0;
  bool done_ = false;
};

}  // namespace

bool flush(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool good = ::fsync(file) == 0;
  ::close(file);
  return good;
}

AtomicFile::AtomicFile(fs::path path) : path_(std::move(path)) {
  const fs::path folder = folder_of(path_);
  if (fs::is_directory(path_)) {
    throw Error(ErrorKind::cannot_create, path_.string(), "is a folder", "name a file");
  }
  if (::access(folder.c_str(), W_OK | X_OK) != 0) cannot_write(path_);
  temporary_ = hidden_beside(path_);
  const int file = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (file < 0) cannot_write(path_);
  ::close(file);
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void AtomicFile::finish() const {
  if (!flush(temporary_)) {
    throw Error(ErrorKind::io, path_.string(), "cannot flush: " + std::string(std::strerror(errno)),
                "check the disk's free space");
  }
  if (const int full = room_behind(temporary_); full != 0) {
    throw Error(ErrorKind::io, path_.string(), "cannot be written whole: " + std::string(std::strerror(full)),
                "free space on the disk, or name another one");
  }
}

void AtomicFile::commit() {
  finish();
  std::error_code error;
  fs::rename(temporary_, path_, error);
  if (error) cannot_rename(path_, error);
  committed_ = true;
  flush(folder_of(path_));  // the name itself; a file system that refuses still holds the data
}

void commit_together(std::span<AtomicFile* const> files) {
  for (const AtomicFile* file : files) file->finish();
  Aside aside(files);
  for (const AtomicFile* file : files) aside.take(file->path());
  for (const AtomicFile* file : files) aside.appear(*file);
  aside.done();
  for (AtomicFile* file : files) {
    file->committed_ = true;
    flush(folder_of(file->path_));
  }
}

void write_text(const AtomicFile& file, std::string_view text) {
  std::ofstream stream(file.temporary(), std::ios::binary);
  if (!stream) {
    throw Error(ErrorKind::cannot_create, file.path().string(), "cannot be opened for writing",
                "check the folder's rights");
  }
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  if (!stream)
    throw Error(ErrorKind::io, file.path().string(), "writing failed", "check the disk's free space");
}

void write_text(const fs::path& path, std::string_view text) {
  AtomicFile file(path);
  write_text(file, text);
  file.commit();
}

std::string read_text(const fs::path& path, std::size_t limit) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    throw Error(ErrorKind::missing_input, path.string(), "is a folder", "name a file");
  }
  std::ifstream stream(path, std::ios::binary);
  if (!stream) {
    throw Error(ErrorKind::missing_input, path.string(),
                "cannot be opened: " + std::string(std::strerror(errno)), "check the path and its rights");
  }
  std::string text;
  char buffer[1 << 16];
  while (stream.read(buffer, sizeof buffer) || stream.gcount() > 0) {
    text.append(buffer, static_cast<std::size_t>(stream.gcount()));
    if (text.size() > limit) {
      throw Error(ErrorKind::data, path.string(), "longer than " + std::to_string(limit) + " bytes",
                  "this file is not what it should be");
    }
  }
  if (stream.bad()) throw Error(ErrorKind::io, path.string(), "reading failed", "check the disk");
  return text;
}

void make_folder(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error || !fs::is_directory(path)) {
    throw Error(ErrorKind::cannot_create, path.string(),
                "cannot make this folder" + (error ? ": " + error.message() : std::string()),
                "name another folder");
  }
}

}  // namespace ecorche::files
