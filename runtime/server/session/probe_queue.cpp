// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/probe_queue.hpp"

#include <utility>

namespace ecorche::server {

void ProbeQueue::ask(Ready ready, bool many, Clock::time_point now) {
  asked_ = now;
  if (many) asked_many_ = now;
  if (present_) return ready(present_, {});
  waiting_.push_back(std::move(ready));
}

std::shared_ptr<ProbeFrame> ProbeQueue::frame_for_job(bool new_pose, Clock::time_point now) {
  std::shared_ptr<ProbeFrame> frame;
  if (anybody_waits() || lately(asked_, now)) frame = spare();
  if (!frame && new_pose) present_ = nullptr;  // it shows an older pose soon
  return frame;
}

// One that nobody asks any more, or a new one: the one that is shown and the one being made are two, and more
// where questions about older ones wait. Null where no more may be kept.
std::shared_ptr<ProbeFrame> ProbeQueue::spare() {
  for (const auto& frame : frames_) {
    if (frame.use_count() == 1) return frame;
  }
  if (kept_->full(frame_bytes_)) return nullptr;
  auto frame = std::make_shared<ProbeFrame>();
  frame->kept = MemoryBudget::Reservation(kept_, frame_bytes_);
  return frames_.emplace_back(std::move(frame));
}

void ProbeQueue::answer(const std::shared_ptr<ProbeFrame>& frame, const Status& status) {
  present_ = frame;
  for (const Ready& ready : std::exchange(waiting_, {})) ready(frame, status);
}

void ProbeQueue::forget(bool anybody_here, Clock::time_point now) {
  if (anybody_waits() || (anybody_here && asked_ && now - *asked_ < forgotten_after)) return;
  present_.reset();
  for (auto& frame : std::exchange(frames_, {})) destroy_later_(std::move(frame));
}

}  // namespace ecorche::server
