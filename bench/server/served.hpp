// SPDX-License-Identifier: Apache-2.0
// `ecorche serve` as a child, and what the system says of it.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include <ecorche/wire/address.hpp>

namespace ecorche::bench {

/// Started with the model, on a free port; stopped by SIGTERM at the end. What the environment's
/// SERVE_OPTIONS holds, parted by blanks, are options, too.
class Served {
 public:
  Served(const std::string& program, const std::string& model, const std::vector<std::string>& options = {});
  ~Served();
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;

  const wire::Address& address() const { return address_; }
  /// Of --http, where that is among the options.
  const wire::Address& http() const { return http_; }
  double rss_mib() const;
  std::size_t descriptors() const;
  /// Seconds of processor time so far.
  double cpu_seconds() const;

 private:
  pid_t pid_ = -1;
  std::string port_file_;
  wire::Address address_, http_;
};

}  // namespace ecorche::bench
