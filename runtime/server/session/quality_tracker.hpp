// SPDX-License-Identifier: Apache-2.0
// What a session's poses are worth, and when that is measured.
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include <ecorche/runtime/pose_quality.hpp>
#include "runtime/server/schedule/executor.hpp"
#include "runtime/server/schedule/turn_queue.hpp"
#include "runtime/server/session/pose_slot.hpp"
#include "runtime/server/session/quality_job.hpp"
#include "runtime/server/session/subscription_table.hpp"

namespace ecorche::server {

/// Frames tell the quality of their pose where it was measured with them, and else the last that was. The
/// present pose is measured beside the stream, in turns with other sessions, once a client has its frame.
/// Where a frame could not tell all of it, its pose is shown again with the rest. On the I/O thread.
class QualityTracker {
 public:
  /// `show`: somebody waits for the present pose.
  QualityTracker(Executor& executor, TurnQueue& turns, SubscriptionTable& table, const PoseSlot& poses,
                 std::shared_ptr<const ServedModel> model, std::function<void()> show)
      : executor_(executor),
        turns_(turns),
        table_(table),
        poses_(poses),
        model_(std::move(model)),
        show_(std::move(show)) {}

  const runtime::QualityThresholds& thresholds() const { return thresholds_; }
  /// Who wants it with every frame waits for the present pose's by these.
  void set_thresholds(const runtime::QualityThresholds& thresholds, Clock::time_point now);

  /// Takes what was measured with the frame, of the row's subscription.
  void frame_made(const PosedFrame& frame, SubscriptionRow& row);
  /// Whether the present pose is to be measured, now that a client has its frame: where cores are shared with
  /// clients, not while they read. Asked, it is forgotten.
  bool take_unmeasured() { return std::exchange(unmeasured_, false); }
  /// The turn has come: measures the present pose, and ends the turn. `owner`, of all this, is kept as long.
  /// False where there is nothing to measure.
  bool measure(std::shared_ptr<const void> owner);

 private:
  void measured(const QualityJob& job);

  Executor& executor_;
  TurnQueue& turns_;
  SubscriptionTable& table_;
  const PoseSlot& poses_;
  std::shared_ptr<const ServedModel> model_;
  std::function<void()> show_;
  runtime::QualityThresholds thresholds_;
  bool unmeasured_ = false;  ///< the present pose, and somebody is sent its frame
};

}  // namespace ecorche::server
