// SPDX-License-Identifier: Apache-2.0
// What all connections of a server share; lives on the I/O thread.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "runtime/server/metrics.hpp"
#include "runtime/server/seams.hpp"
#include "runtime/server/session.hpp"

namespace ecorche::server {

class House {
 public:
  House(net::io_context& io, Workers& workers, Options options,
        std::vector<std::shared_ptr<const ServedModel>> models, Seams seams);

  const Options& options() const { return options_; }
  const Limits& limits() const { return options_.limits; }
  const std::vector<std::shared_ptr<const ServedModel>>& models() const { return models_; }

  /// The session that the request names, made where it is new. not_found for an unknown model,
  /// invalid_argument for an odd name, failed_precondition for a session of another model, resource_exhausted
  /// for one session too many.
  Status open(const v1::OpenModel& request, std::shared_ptr<Session>& out);

  Metrics& metrics() { return metrics_; }
  /// Waits for the timer.
  net::awaitable<void> wait(net::steady_timer& timer, boost::system::error_code& ec);

  std::size_t sessions() const { return sessions_.size(); }
  /// Ends the sessions that are over.
  void sweep(Clock::time_point now);

 private:
  net::io_context& io_;
  Workers& workers_;
  Options options_;
  std::vector<std::shared_ptr<const ServedModel>> models_;
  Seams seams_;
  Metrics metrics_;
  std::map<std::string, std::shared_ptr<Session>> sessions_;
  std::uint64_t unnamed_ = 0;
};

}  // namespace ecorche::server
