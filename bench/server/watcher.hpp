// SPDX-License-Identifier: Apache-2.0
// One who watches a volume of a session that another poses.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include <ecorche/v1/envelope.pb.h>
#include "bench/server/served.hpp"

namespace ecorche::bench {

/// On a thread of its own, from its making on; reads every frame whole, and drops it.
class Watcher {
 public:
  /// Joins the session; `selection` without the volume's name asks for the model's first one. Throws as
  /// client::Client.
  Watcher(const Served& served, const std::string& session, v1::VolumeSelection selection);
  ~Watcher();
  Watcher(const Watcher&) = delete;
  Watcher& operator=(const Watcher&) = delete;

  std::uint64_t frames() const { return frames_; }
  std::uint64_t bytes() const { return bytes_; }
  /// Why it ended early; empty: it did not.
  const std::string& error() const { return error_; }
  /// Waits for its end; frames() stays.
  void stop();

 private:
  void watch(const wire::Address& address, const std::string& session, v1::VolumeSelection selection);

  std::atomic<std::uint64_t> frames_ = 0, bytes_ = 0;
  std::atomic<bool> stopping_ = false;
  std::string error_;
  std::thread thread_;
};

/// A plane through the middle of the first volume of the model, across the body: 512 by 512 pixels of it.
v1::VolumeSelection middle_plane(const Served& served);

}  // namespace ecorche::bench
