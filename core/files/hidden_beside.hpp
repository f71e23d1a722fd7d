// SPDX-License-Identifier: Apache-2.0
// Names of what is written beside something and not whole yet.
#pragma once

#include <filesystem>
#include <system_error>

namespace ecorche::files {

/// `.PID.RANDOM.part.NAME` in the folder of `path`, whose name is NAME: hidden, with all extensions kept
/// (.nii.gz; some writers choose the format by them), guessed by nobody. The process is named for
/// remove_stale_parts. Sets `error` where the system has no random numbers.
std::filesystem::path hidden_beside(const std::filesystem::path& path, std::error_code& error);

}  // namespace ecorche::files
