// SPDX-License-Identifier: Apache-2.0
// Motion that the server plays by itself.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <ecorche/values/pose.hpp>
#include "runtime/server/net/asio.hpp"

namespace ecorche::server {

/// Poses of one rig; a pose stays until the next is due.
struct Clip {
  std::string name;
  std::vector<double> at;   ///< seconds, ascending, from 0
  std::vector<Pose> poses;  ///< as many
  /// How long the last pose stays: a loop begins again after it.
  double last_seconds = 1.0 / 30;

  double seconds() const { return at.empty() ? 0 : at.back() + last_seconds; }
  double frames_per_second() const { return at.empty() ? 0 : static_cast<double>(at.size()) / seconds(); }
};

/// Shows a clip's poses when they are due; late ones are left out. For the I/O thread.
class ClipPlayer : public std::enable_shared_from_this<ClipPlayer> {
 public:
  /// `show` gets every pose; none after stop().
  ClipPlayer(net::io_context& io, std::function<void(const Pose&)> show)
      : timer_(io), show_(std::move(show)) {}

  void play(std::shared_ptr<const Clip> clip, double speed, bool loop);
  void stop();
  /// stop() for good: whoever made it goes.
  void release();
  bool playing() const { return clip_ != nullptr; }

 private:
  void step();

  net::steady_timer timer_;
  std::function<void(const Pose&)> show_;
  std::shared_ptr<const Clip> clip_;
  double speed_ = 1;
  bool loop_ = false;
  Clock::time_point start_;
  std::uint64_t run_ = 0;  ///< tells a timer of an earlier one
};

}  // namespace ecorche::server
