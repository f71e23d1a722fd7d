// SPDX-License-Identifier: Apache-2.0
// A recording played back against a server.
#pragma once

#include <filesystem>

#include <ecorche/client/client.hpp>
#include "app/program.hpp"

namespace ecorche::app {

/// Sends the recorded poses one by one, each after the frames of the one before, and compares every frame's
/// bytes with what was recorded. 0 when all are the same, else 1. Throws Error{data} for a file that is no
/// recording, and what the client throws.
int replay(const Program& program, const std::filesystem::path& file, const wire::Address& address,
           const client::Access& access);

}  // namespace ecorche::app
