// SPDX-License-Identifier: Apache-2.0
#include "core/files/atomic_file.hpp"

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include <ecorche/values/error.hpp>
#include "core/files/hidden_beside.hpp"
#include "core/files/look.hpp"
#include "core/platform/file.hpp"
#include "core/platform/process.hpp"
#include "core/values/text.hpp"

namespace ecorche::files {

namespace fs = std::filesystem;

namespace {

// Writers of other libraries may not tell that the disk was full: a file behind which no block fits is not
// trusted to be whole. Leaves its length alone.
std::error_code room_behind(const fs::path& path) {
  constexpr std::uint64_t block = 1 << 16;
  std::error_code error;
  platform::File file(path, platform::Open::write, error);
  if (error) return error;
  const std::uint64_t length = file.size(error);
  if (!error) {
    error = file.reserve(length, block);
    const std::error_code cut = file.resize(length);
    if (!error) error = cut;
  }
  return platform::is_full(error) ? error : std::error_code();
}

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

[[noreturn]] void cannot_write(const fs::path& path, const std::error_code& error) {
  throw Error(ErrorKind::cannot_create, path.string(), "cannot write here: " + error.message(),
              "make the folder, or name another one");
}

[[noreturn]] void cannot_rename(const fs::path& path, const std::error_code& error) {
  throw Error(ErrorKind::io, path.string(), "cannot rename: " + error.message(), "check the folder's rights");
}

// Puts back what stood under the names of files that are committed together, unless all of them are.
class Rollback {
 public:
  explicit Rollback(std::span<AtomicFile* const> files) : files_(files) {}
  ~Rollback() {
    std::error_code ignored;
    for (std::size_t i = 0; !dismissed_ && i < placed_; ++i) fs::remove(files_[i]->path(), ignored);
    for (const auto& [path, hidden] : moved_) {
      if (dismissed_) {
        fs::remove(hidden, ignored);
      } else {
        fs::rename(hidden, path, ignored);
      }
    }
  }
  Rollback(const Rollback&) = delete;
  Rollback& operator=(const Rollback&) = delete;

  void move_old(const fs::path& path) {
    std::error_code error;
    const fs::file_status before = fs::symlink_status(path, error);
    if (!fs::exists(before) || fs::is_directory(before)) return;  // a folder stays, and is in the way
    const fs::path hidden = hidden_beside(path, error);
    if (!error) fs::rename(path, hidden, error);
    if (error) cannot_rename(path, error);
    moved_.emplace_back(path, hidden);
  }
  void place_new(const AtomicFile& file) {
    std::error_code error;
    fs::rename(file.temporary(), file.path(), error);
    if (error) cannot_rename(file.path(), error);
    ++placed_;
  }
  void dismiss() { dismissed_ = true; }

 private:
  std::span<AtomicFile* const> files_;
  std::vector<std::pair<fs::path, fs::path>> moved_;
  std::size_t placed_ = 0;
  bool dismissed_ = false;
};

}  // namespace

AtomicFile::AtomicFile(fs::path path) : path_(std::move(path)) {
  const fs::path folder = folder_of(path_);
  if (is_folder(path_)) {
    throw Error(ErrorKind::cannot_create, path_.string(), "is a folder", "name a file");
  }
  if (const std::error_code error = platform::cannot_make_in(folder)) cannot_write(path_, error);
  std::error_code error;
  temporary_ = hidden_beside(path_, error);
  if (error) cannot_write(path_, error);
  const platform::File file(temporary_, platform::Open::make, error);
  if (error) cannot_write(path_, error);
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void AtomicFile::finish() const {
  if (const std::error_code error = platform::flush(temporary_)) {
    throw Error(ErrorKind::io, path_.string(), "cannot flush: " + error.message(),
                "check the disk's free space");
  }
  if (const std::error_code full = room_behind(temporary_)) {
    throw Error(ErrorKind::io, path_.string(), "cannot be written whole: " + full.message(),
                "free space on the disk, or name another one");
  }
}

void AtomicFile::commit() {
  finish();
  std::error_code error;
  fs::rename(temporary_, path_, error);
  if (error) cannot_rename(path_, error);
  committed_ = true;
  platform::flush(folder_of(path_));  // the name itself; a file system that refuses still holds the data
}

void commit_together(std::span<AtomicFile* const> files) {
  for (const AtomicFile* file : files) file->finish();
  Rollback rollback(files);
  for (const AtomicFile* file : files) rollback.move_old(file->path());
  for (const AtomicFile* file : files) rollback.place_new(*file);
  rollback.dismiss();
  for (AtomicFile* file : files) {
    file->committed_ = true;
    platform::flush(folder_of(file->path_));
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
  if (!error && fs::is_directory(path, error)) return;
  throw Error(ErrorKind::cannot_create, path.string(),
              "cannot make this folder" + (error ? ": " + error.message() : std::string()),
              "name another folder");
}

}  // namespace ecorche::files
