// SPDX-License-Identifier: Apache-2.0
// Another program, run beside us at the same terminal.
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

namespace ecorche::platform {

/// Where a program of that name is found, as a shell would (PATH).
std::optional<std::filesystem::path> find_program(const std::string& name);

/// Runs `program` with `words` and waits for it. Its input is ours; what it prints goes to our errors, since
/// our output is a result's. A stop is passed on as one SIGINT to it and to all that it started; then it is
/// waited for. It is told to stop as well when this process dies. Returns its exit code, or 128 and the
/// signal that ended it. Throws Error{internal} when it cannot be started.
int run_program(const std::filesystem::path& program, const std::vector<std::string>& words,
                const std::stop_token& stop);

}  // namespace ecorche::platform
