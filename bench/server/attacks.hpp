// SPDX-License-Identifier: Apache-2.0
// What a newcomer sees while others do what they should not.
#pragma once

#include <string>

namespace ecorche::bench {

/// One attack after another on a server of the model, each for so many seconds from a thread of its own:
/// connections that ask for the largest frames, read nothing and are renewed every 2.4 s (2, 12, 40 of them),
/// and 1500 HTTP requests a second. Prints, for each and for none: how soon newcomers had their first frame
/// from their connecting, of all bodies whole in float32, how soon WebSockets began, /healthz answered, and
/// how much memory the server took.
void attacks(const std::string& program, const std::string& model, double seconds);

}  // namespace ecorche::bench
