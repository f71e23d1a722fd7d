// SPDX-License-Identifier: Apache-2.0
// What killed writers left behind.
#pragma once

#include <filesystem>
#include <string_view>

namespace ecorche::files {

/// Removes the temporaries of AtomicFile in `folder` for files that are to be called `name`, of processes
/// that live no more on this machine. Two that write the same name at once, one of them elsewhere, must not
/// share a folder. What cannot be read or removed is left. Reads the whole folder.
void remove_stale_parts(const std::filesystem::path& folder, std::string_view name);
/// The same for all names that end so.
void remove_stale_parts_ending(const std::filesystem::path& folder, std::string_view ending);

/// The same for the folders of StagedFolder, with all that is in them.
void remove_stale_folders(const std::filesystem::path& folder, std::string_view name);

}  // namespace ecorche::files
