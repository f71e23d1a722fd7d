// SPDX-License-Identifier: Apache-2.0
// Who waits for a posed body to ask, and the frames that are made ready for it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "runtime/server/net/asio.hpp"
#include "runtime/server/resources/memory_budget.hpp"
#include "runtime/server/schedule/destroy_later.hpp"
#include "runtime/server/session/pose_job.hpp"

namespace ecorche::server {

/// As long as somebody asks every second, every pose is made ready. Plain bookkeeping; every time comes from
/// the caller.
class ProbeQueue {
 public:
  /// So long after the last question poses are still made ready for the next; and so long what that takes is
  /// kept.
  static constexpr std::chrono::seconds recent{1}, forgotten_after{10};

  /// With the posed body, or with null and the reason.
  using Ready = std::function<void(const std::shared_ptr<const ProbeFrame>&, const Status&)>;

  /// `frame_bytes`: of one frame, which are counted in `kept`.
  ProbeQueue(std::uint64_t frame_bytes, std::shared_ptr<const Pool> kept, DestroyLater destroy_later)
      : frame_bytes_(frame_bytes), kept_(std::move(kept)), destroy_later_(std::move(destroy_later)) {}

  /// Calls `ready`, at once where the body is at hand, else once a job has made it. `many`: points.
  void ask(Ready ready, bool many, Clock::time_point now);
  bool anybody_waits() const { return !waiting_.empty(); }

  /// For a job to fill, which shows a new pose or the present one again; null where nobody asks, or no more
  /// may be kept.
  std::shared_ptr<ProbeFrame> frame_for_job(bool new_pose, Clock::time_point now);
  /// Many points are asked: all of the body is to be made ready.
  bool many(Clock::time_point now) const { return lately(asked_many_, now); }
  /// The frame that a job has filled.
  void fill(const std::shared_ptr<ProbeFrame>& frame) { answer(frame, {}); }
  /// A job could not.
  void fail(const Status& status) { answer(nullptr, status); }
  /// The frame of the pose that is shown.
  const std::shared_ptr<const ProbeFrame>& present() const { return present_; }

  /// Lets go of all frames where nobody has asked of late, or nobody is here; not while a job has one.
  void forget(bool anybody_here, Clock::time_point now);

 private:
  static bool lately(const std::optional<Clock::time_point>& then, Clock::time_point now) {
    return then && now - *then < recent;
  }
  std::shared_ptr<ProbeFrame> spare();
  void answer(const std::shared_ptr<ProbeFrame>& frame, const Status& status);

  std::uint64_t frame_bytes_;
  std::shared_ptr<const Pool> kept_;
  DestroyLater destroy_later_;
  std::vector<std::shared_ptr<ProbeFrame>> frames_;  ///< to be filled again once nobody asks them
  std::shared_ptr<const ProbeFrame> present_;
  std::vector<Ready> waiting_;
  std::optional<Clock::time_point> asked_, asked_many_;
};

}  // namespace ecorche::server
