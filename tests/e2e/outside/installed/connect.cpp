// SPDX-License-Identifier: Apache-2.0
// connect HOST:PORT: which server answers there, and what it serves.
#include <cstdio>
#include <ecorche/client/client.hpp>

int main(int, char** argv) try {
  ecorche::client::Client client(ecorche::wire::parse_address(argv[1]), "outside");
  std::printf("server %s\n", client.server().server().c_str());
  return 0;
} catch (const ecorche::Error& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return 1;
}
