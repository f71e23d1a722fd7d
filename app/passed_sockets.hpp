// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/platform/service.hpp"
#include "runtime/server/resources/options.hpp"

namespace ecorche::app {

/// Sockets that a service manager listens at take the place of --listen and --http: one that it calls `http`
/// that of the latter, of others the first that of frames, the second that of HTTP. Throws Error{config} for
/// one too many, and for one of HTTP beside --no-http.
void take_passed_sockets(const std::vector<platform::PassedSocket>& sockets, server::Options& options);

}  // namespace ecorche::app
