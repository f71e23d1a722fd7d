// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include <ecorche/values/context.hpp>

namespace ecorche::io {

/// XXH64 (seed 0) of a file's bytes. Throws Error{missing_input}, Error{io}.
std::uint64_t file_digest(const std::filesystem::path& path, const Context& context);

}  // namespace ecorche::io
