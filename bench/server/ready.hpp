// SPDX-License-Identifier: Apache-2.0
// How long a server takes from its start to its first frame.
#pragma once

#include <string>

namespace ecorche::bench {

/// Starts it some times and prints, of the quickest start: until it listens (and answers: nothing is put off
/// until later that every client needs), until a client holds the first frame of the whole body in float32,
/// until one that comes then holds that of a coarser level; the processor's time and the memory.
void ready(const std::string& program, const std::string& model);

}  // namespace ecorche::bench
