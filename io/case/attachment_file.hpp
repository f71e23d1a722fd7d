// SPDX-License-Identifier: Apache-2.0
// What hangs on which segment, said by hand (docs/reference/volumetric.md).
#pragma once

#include <filesystem>

#include <ecorche/values/attachment.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::io {

/// A file of `ecorche_attachment: 1` with `splits` and `regions`, LPS mm, in the names of `skeleton`. Every
/// mistake is Error{config} with file, line and key. Throws Error{missing_input}.
Reassignment read_attachment(const std::filesystem::path& path, const Skeleton& skeleton);

}  // namespace ecorche::io
