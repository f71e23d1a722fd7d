// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/resources/shares.hpp"

#include "runtime/server/net/asio.hpp"

namespace ecorche::server {

std::string address_of(const std::string& peer) {
  boost::system::error_code ec;
  const net::ip::address address = net::ip::make_address(peer.substr(0, peer.rfind(':')), ec);
  if (ec) return peer;
  if (address.is_v4()) return address.to_string();
  const net::ip::address_v6 v6 = address.to_v6();
  if (v6.is_v4_mapped()) return net::ip::make_address_v4(net::ip::v4_mapped, v6).to_string();
  if (v6.is_loopback()) return v6.to_string();
  net::ip::address_v6::bytes_type bytes = v6.to_bytes();
  std::fill(bytes.begin() + 8, bytes.end(), static_cast<unsigned char>(0));
  return net::ip::address_v6(bytes).to_string() + "/64";
}

}  // namespace ecorche::server
