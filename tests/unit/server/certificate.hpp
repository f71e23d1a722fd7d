// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string>

namespace ecorche::server {

/// A certificate for 127.0.0.1 by the openssl command: FILE.pem and its key FILE.key. False where it failed.
inline bool make_certificate(const std::string& file) {
  const std::string command =
      "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=test "
      "-addext subjectAltName=IP:127.0.0.1 -keyout " +
      file + ".key -out " + file + ".pem 2>/dev/null";
  return std::system(command.c_str()) == 0;
}

}  // namespace ecorche::server
