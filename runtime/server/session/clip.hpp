// SPDX-License-Identifier: Apache-2.0
// Motion that the server plays by itself.
#pragma once

#include <functional>
#include <memory>
#include <optional>
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
  /// Of the pose that is due so long after the first one.
  std::size_t row_at(double seconds) const;
};

/// How a clip is played; `position` in its seconds, from 0 to Clip::seconds().
struct ClipStart {
  double speed = 1;
  bool loop = false;
  bool paused = false;
  double position = 0;
};

/// What is to change of that; nothing: it stays.
struct ClipSteering {
  std::optional<bool> paused;
  std::optional<double> position;
  int step = 0;  ///< so many poses on, and paused there
  std::optional<double> speed;
  std::optional<bool> loop;
};

/// Shows a clip's poses when they are due; late ones are left out. At its end a clip that does not loop
/// stays, until it is steered elsewhere or stopped. For the I/O thread.
class ClipPlayer : public std::enable_shared_from_this<ClipPlayer> {
 public:
  /// `show` gets every pose; none after stop(). `changed`: status() is another one, for other reasons than
  /// that time goes by; it throws nothing.
  ClipPlayer(
      net::io_context& io, std::function<void(const Pose&)> show, std::function<void()> changed = [] {})
      : timer_(io), show_(std::move(show)), changed_(std::move(changed)) {}

  void play(std::shared_ptr<const Clip> clip, const ClipStart& start);
  /// Nothing where there is no clip.
  void steer(const ClipSteering& to);
  /// Throws nothing.
  void stop();
  /// stop() for good: whoever made it goes.
  void release();

  /// Null: there is none.
  const std::shared_ptr<const Clip>& clip() const { return clip_; }
  bool playing() const { return playing_; }
  double position() const;
  double speed() const { return speed_; }
  bool loops() const { return loop_; }

 private:
  double played() const;
  double within(double played) const;
  void go_to(double played);
  void show_now();
  void wait_for_next(double played);

  net::steady_timer timer_;
  std::function<void(const Pose&)> show_;
  std::function<void()> changed_;
  std::shared_ptr<const Clip> clip_;
  double speed_ = 1;
  bool loop_ = false;
  bool playing_ = false;
  std::optional<std::size_t> shown_;  ///< row
  double at_ = 0;            ///< clip's seconds that were played at `since_`, all rounds of a loop together
  Clock::time_point since_;  ///< while it plays
  std::uint64_t run_ = 0;    ///< tells a timer of an earlier one
};

}  // namespace ecorche::server
