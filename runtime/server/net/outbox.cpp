// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/net/outbox.hpp"

#include <algorithm>
#include <utility>

namespace ecorche::server {

void Outbox::answer(SharedFrame frame) {
  answers_.push_back(std::move(frame));
}

std::uint64_t Outbox::answer_bytes() const {
  std::uint64_t bytes = 0;
  for (const SharedFrame& frame : answers_) bytes += frame->bytes();
  return bytes;
}

std::uint64_t Outbox::bytes() const {
  std::uint64_t bytes = answer_bytes();
  for (const auto& [id, lane] : lanes_) {
    for (const Waiting* waiting : {&lane.keyframe, &lane.newest})
      bytes += waiting->frame ? waiting->frame->bytes() : 0;
  }
  return bytes;
}

bool Outbox::arrives(std::uint32_t subscription) const {
  const auto found = lanes_.find(subscription);
  return found != lanes_.end() && found->second.flow.arrives();
}

Clock::duration Outbox::longest_gap(std::uint32_t subscription) const {
  const auto found = lanes_.find(subscription);
  return found == lanes_.end() ? Clock::duration() : found->second.flow.longest_gap();
}

std::uint32_t Outbox::ask_level(std::uint32_t subscription, std::uint32_t finest, std::uint32_t coarsest,
                                bool still, Clock::time_point now) {
  Lane& asked = lane(subscription);
  const std::uint32_t level = asked.flow.level(finest, coarsest, now);
  return asked.level = still ? finest : level;
}

bool Outbox::enqueue(std::uint32_t subscription, std::uint32_t level, std::uint64_t number,
                     std::uint64_t keyframe, SharedFrame frame) {
  Lane& to = lane(subscription);
  if (level != to.level) return true;
  const bool is_key = keyframe == number;
  if (keyframe != 0 && !is_key && keyframe != to.keyframes[level]) return false;
  if (to.newest.frame) ++replaced_;
  to.newest = {};
  if (is_key) {
    // One of another level is lost with it.
    if (to.keyframe.frame) {
      ++replaced_;
      std::erase_if(to.keyframes, [&](const auto& entry) { return entry.second == to.keyframe.number; });
    }
    to.keyframes[level] = number;
  }
  (is_key ? to.keyframe : to.newest) = {std::move(frame), number};
  return true;
}

void Outbox::acknowledge(std::uint32_t subscription, std::uint64_t number, Clock::time_point now) {
  const auto found = lanes_.find(subscription);
  if (found != lanes_.end()) found->second.flow.arrived(number, now);
}

std::shared_ptr<const void> Outbox::clear() {
  struct All {
    std::deque<SharedFrame> answers;
    std::map<std::uint32_t, Lane> lanes;
  };
  auto all = std::make_shared<All>();
  all->answers.swap(answers_);
  all->lanes.swap(lanes_);
  return all;
}

SharedFrame Outbox::next(Clock::time_point now) {
  last_was_posed_ = false;
  if (!answers_.empty()) {
    SharedFrame frame = std::move(answers_.front());
    answers_.pop_front();
    return frame;
  }
  // Starting behind the lane that was served last, so that a busy one cannot starve the others.
  auto next = lanes_.upper_bound(last_lane_);
  for (std::size_t tried = 0; tried < lanes_.size(); ++tried, ++next) {
    if (next == lanes_.end()) next = lanes_.begin();
    Lane& candidate = next->second;
    Waiting& waiting = candidate.keyframe.frame ? candidate.keyframe : candidate.newest;
    if (!waiting.frame || !candidate.flow.may_leave(now)) continue;
    last_lane_ = next->first;
    last_was_posed_ = true;
    candidate.flow.left(waiting.number, now);
    return std::exchange(waiting, {}).frame;
  }
  return nullptr;
}

void Outbox::written(Clock::time_point now) {
  if (!last_was_posed_) return;
  if (const auto found = lanes_.find(last_lane_); found != lanes_.end()) found->second.flow.written(now);
}

std::optional<Clock::time_point> Outbox::oldest_in_flight() const {
  return oldest(&Flow::oldest);
}

std::optional<Clock::time_point> Outbox::oldest_written() const {
  return oldest(&Flow::oldest_written);
}

std::optional<Clock::time_point> Outbox::oldest(std::optional<Clock::time_point> (Flow::*of)() const) const {
  std::optional<Clock::time_point> oldest;
  for (const auto& [id, waiting] : lanes_) {
    if (const auto when = (waiting.flow.*of)())
      oldest = std::min(oldest.value_or(Clock::time_point::max()), *when);
  }
  return oldest;
}

}  // namespace ecorche::server
