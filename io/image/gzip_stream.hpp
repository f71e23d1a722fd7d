// SPDX-License-Identifier: Apache-2.0
// gzip by all threads: a CT of hundreds of megabytes takes one thread longer than anything else.
#pragma once

#include <cstddef>
#include <fstream>
#include <functional>
#include <span>

namespace ecorche::io {

/// Fills `out` with the bytes of a stream from `begin` on. Called by several threads at once.
using ByteSource = std::function<void(std::size_t begin, std::span<std::byte> out)>;

/// Writes `size` bytes as one gzip stream (RFC 1952), in pieces that are packed beside each other; the same
/// bytes for any number of threads. What goes wrong in writing stands in the file's state.
void write_gzip(std::ofstream& file, std::size_t size, const ByteSource& source);

}  // namespace ecorche::io
