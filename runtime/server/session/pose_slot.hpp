// SPDX-License-Identifier: Apache-2.0
// The pose that waits, the pose that is shown, and whether the body moves.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include "runtime/server/net/asio.hpp"
#include "runtime/server/session/pose_job.hpp"

namespace ecorche::server {

/// Poses overtaken by newer ones since the last that a job was given.
struct Skipped {
  static constexpr std::size_t most_listed = 256;
  std::uint64_t count = 0;
  std::deque<std::uint64_t> newest;  ///< sequence numbers, oldest first

  void add(std::uint64_t sequence);
};

/// One pose waits, and a newer one replaces it. Plain bookkeeping; every time comes from the caller.
class PoseSlot {
 public:
  /// Without another pose for so long, the body stands still: it is shown in full detail, and what comes next
  /// is judged at once.
  static constexpr std::chrono::milliseconds still_after{150};
  /// Within a stream the next pose comes so soon.
  static constexpr std::chrono::milliseconds next_within{50};

  /// What is shown first.
  explicit PoseSlot(Pose pose) { present_.pose = std::move(pose); }

  /// `busy`: a job is under way.
  void put(PoseRequest request, Clock::time_point now, bool busy);
  bool waiting() const { return next_.has_value(); }
  /// Of the newest pose, shown or not.
  std::uint64_t last_sequence() const { return last_sequence_; }
  /// The waiting pose came after a rest.
  bool after_rest() const { return after_rest_; }

  /// A job begins with the waiting pose.
  void begin(Clock::time_point now);
  /// The waiting pose, for that job.
  PoseRequest take();
  Skipped take_skipped() { return std::exchange(skipped_, {}); }
  /// A job is over.
  void end(Clock::time_point now) { stirred_ = now; }

  /// The pose that is shown.
  const PoseRequest& present() const { return present_; }
  void show(const PoseRequest& request) { present_ = request; }

  /// Nothing comes, and nothing is being made: where frames lag behind poses, however far, each would lag
  /// farther for being judged on its way.
  bool rests(Clock::time_point now, bool busy) const { return !busy && now - stirred_ > still_after; }
  /// The pose has not become another one of late.
  bool still(Clock::time_point now) const { return now - moved_ > still_after; }
  /// When the pose last became another one.
  Clock::time_point moved() const { return moved_; }
  /// Until when the next pose of the stream is expected; nothing where none is.
  std::optional<Clock::time_point> next_expected(Clock::time_point now) const;

 private:
  std::optional<PoseRequest> next_;
  Skipped skipped_;
  PoseRequest present_;
  std::uint64_t last_sequence_ = 0;
  bool after_rest_ = false;
  Clock::time_point begun_{};    ///< when the last job began with a new pose
  Clock::time_point stirred_{};  ///< when the last pose came, or the last job ended
  Clock::time_point moved_{};    ///< when the pose last became another one
};

}  // namespace ecorche::server
