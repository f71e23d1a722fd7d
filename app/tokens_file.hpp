// SPDX-License-Identifier: Apache-2.0
// The tokens that a server takes, in a file that does not tell them.
#pragma once

#include <string>
#include <vector>

#include "runtime/server/net/passes.hpp"

namespace ecorche::app {

/// Reads
///
///     ecorche_tokens: 1
///     tokens:
///       - {name: ward_3, sha256: 9f86d081..., role: pose, max_connections: 8, message_rate: 500}
///
/// Throws Error{config} that names file, line and key for what is not so, for two of a name or of a digest,
/// and for none at all.
std::vector<server::Pass> read_tokens(const std::string& path);

}  // namespace ecorche::app
