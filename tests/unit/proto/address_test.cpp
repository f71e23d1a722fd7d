// SPDX-License-Identifier: Apache-2.0
#include <ecorche/wire/address.hpp>

#include <gtest/gtest.h>

namespace ecorche::wire {
namespace {

TEST(Address, HostAndPort) {
  EXPECT_EQ(parse_address("127.0.0.1:7070").host, "127.0.0.1");
  EXPECT_EQ(parse_address("127.0.0.1:7070").port, 7070);
  EXPECT_EQ(parse_address("localhost:0").port, 0);
  EXPECT_EQ(parse_address("[::1]:7070").host, "::1");
}

TEST(Address, OddOnesAreUsageErrors) {
  for (const char* text : {"", "7070", ":7070", "host:", "host:70x", "host:65536", "host:-1", "[]:1"}) {
    EXPECT_THROW(parse_address(text), Error) << text;
  }
}

}  // namespace
}  // namespace ecorche::wire
