// SPDX-License-Identifier: Apache-2.0
// This process, and whether another one lives.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <system_error>

namespace ecorche::platform {

int process_id();

/// Whether a process, anybody's, has that number.
bool process_exists(int id);

/// The most memory that this process has held; 0 where the system does not tell.
std::uint64_t peak_memory_bytes();

/// The program that this process runs; it can be read even when its file has been replaced.
std::filesystem::path own_program();

/// Fills `out` from the system's random numbers, which nobody can guess.
std::error_code fill_random(std::span<std::byte> out);

}  // namespace ecorche::platform
