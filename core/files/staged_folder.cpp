// SPDX-License-Identifier: Apache-2.0
#include "core/files/staged_folder.hpp"

#include <algorithm>
#include <system_error>

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"
#include "core/files/stale_parts.hpp"
#include "core/platform/file.hpp"
#include "core/platform/process.hpp"

namespace ecorche::files {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::error_code& error) {
  throw Error(ErrorKind::io, path.string(), "cannot be moved into place: " + error.message(),
              "check the folder's rights and the disk");
}

void move(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (error) fail(to, error);
}

// Without the slash behind it, which would leave it no name.
fs::path named(const fs::path& path) {
  const fs::path plain = path.lexically_normal();
  return plain.has_filename() ? plain : plain.parent_path();
}

}  // namespace

StagedFolder::StagedFolder(const fs::path& target, std::string seal)
    : target_(named(target)), seal_(std::move(seal)) {
  std::error_code ignored;
  within_ = fs::exists(target_, ignored);
  if (within_ && !fs::is_directory(target_, ignored))
    throw Error(ErrorKind::cannot_create, target_.string(), "is a file", "name a folder");
  const fs::path around = within_                     ? target_
                          : target_.has_parent_path() ? target_.parent_path()
                                                      : fs::path(".");
  make_folder(around);
  const std::string name = within_ ? seal_ : target_.filename().string();
  remove_stale_folders(around, name);
  stage_ = around / ("." + std::to_string(platform::process_id()) + ".part." + name);
  std::error_code error;
  if (!fs::create_directory(stage_, error)) {  // never one that somebody else put there
    if (!error) error = std::make_error_code(std::errc::file_exists);
    throw Error(ErrorKind::cannot_create, target_.string(),
                "cannot make a folder to write in meanwhile: " + error.message(),
                "check the rights of the folder that it is in, or name another one");
  }
}

StagedFolder::~StagedFolder() {
  std::error_code ignored;
  fs::remove_all(stage_, ignored);
}

void StagedFolder::commit(const std::vector<fs::path>& old) {
  if (within_) {
    move_into_target(old);
    platform::flush(target_);
  } else {
    move(stage_, target_);
    platform::flush(target_.has_parent_path() ? target_.parent_path() : fs::path("."));
  }
}

void StagedFolder::move_into_target(const std::vector<fs::path>& old) {
  std::error_code error;
  fs::remove(target_ / seal_, error);
  if (error) fail(target_ / seal_, error);
  for (const fs::path& file : old) {
    fs::remove(target_ / file, error);
    if (error) fail(target_ / file, error);
    // Folders that held nothing else go with it.
    for (fs::path up = file.parent_path(); !up.empty(); up = up.parent_path()) {
      if (!fs::remove(target_ / up, error)) break;
    }
  }
  for (const fs::path& file : files_within(stage_)) {
    if (file == seal_) continue;
    make_folder((target_ / file).parent_path());
    move(stage_ / file, target_ / file);
  }
  move(stage_ / seal_, target_ / seal_);
}

std::vector<fs::path> files_within(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder, error); !error && at != fs::recursive_directory_iterator();
       at.increment(error)) {
    if (at->symlink_status().type() != fs::file_type::directory)
      out.push_back(at->path().lexically_relative(folder));
  }
  if (error)
    throw Error(ErrorKind::io, folder.string(), "cannot be listed: " + error.message(),
                "check the folder's rights");
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace ecorche::files
