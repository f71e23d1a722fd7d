// SPDX-License-Identifier: Apache-2.0
#include "core/files/scratch_folder.hpp"

#include <system_error>

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"
#include "core/files/hidden_beside.hpp"
#include "core/files/stale_parts.hpp"

namespace ecorche::files {
namespace {

namespace fs = std::filesystem;

// `.` and `posed/` have names, too.
fs::path with_a_name(const fs::path& path) {
  const fs::path plain = fs::absolute(path).lexically_normal();
  return plain.has_filename() ? plain : plain.parent_path();
}

}  // namespace

ScratchFolder::ScratchFolder(const fs::path& target) {
  const fs::path named = with_a_name(target);
  make_folder(named.parent_path());
  remove_stale_folders(named.parent_path(), named.filename().string());
  std::error_code error;
  path_ = hidden_beside(named, error);
  if (!error && !fs::create_directory(path_, error) && !error)
    error = std::make_error_code(std::errc::file_exists);
  if (!error) fs::permissions(path_, fs::perms::owner_all, error);
  if (!error) return;
  throw Error(ErrorKind::cannot_create, target.string(),
              "cannot make a folder to write in meanwhile: " + error.message(),
              "check the rights of the folder that it is in, or name another one");
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace ecorche::files
