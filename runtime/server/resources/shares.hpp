// SPDX-License-Identifier: Apache-2.0
// Of what all clients share: how much one of them may have.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

namespace ecorche::server {

/// Whose a client is, of peer_of(): of `192.0.2.7:4711` and `::ffff:192.0.2.7:4711` `192.0.2.7`; of another
/// IPv6 address its first 64 bits, `2001:db8:1:2::/64`, since one customer has all of those (RFC 6177). What
/// is no address stays as it is. Clients behind one proxy or translator have one address: a share is
/// therefore most of all there is (Limits::peer_share), so that they are many without being all.
std::string address_of(const std::string& peer);

/// The share of so many that one may have: at least one.
inline std::uint64_t portion(std::uint64_t of, double share) {
  return std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(of))));
}

}  // namespace ecorche::server
