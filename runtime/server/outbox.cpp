// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/outbox.hpp"

#include <algorithm>
#include <utility>

namespace ecorche::server {

void Outbox::answer(wire::EncodedFrame frame) {
  answers_.push_back(std::make_shared<const wire::EncodedFrame>(std::move(frame)));
}

void Outbox::offer(std::uint32_t subscription, std::uint64_t number, SharedFrame frame) {
  Lane& lane = lanes_[subscription];
  if (lane.waiting) ++replaced_;
  lane.waiting = std::move(frame);
  lane.waiting_number = number;
}

void Outbox::acknowledge(std::uint32_t subscription, std::uint64_t number) {
  const auto lane = lanes_.find(subscription);
  if (lane == lanes_.end()) return;
  auto& in_flight = lane->second.in_flight;
  while (!in_flight.empty() && in_flight.front().number <= number) in_flight.pop_front();
}

SharedFrame Outbox::next(Clock::time_point now) {
  last_was_posed_ = false;
  if (!answers_.empty()) {
    SharedFrame frame = std::move(answers_.front());
    answers_.pop_front();
    return frame;
  }
  // Starting behind the lane that was served last, so that a busy one cannot starve the others.
  auto lane = lanes_.upper_bound(last_lane_);
  for (std::size_t tried = 0; tried < lanes_.size(); ++tried, ++lane) {
    if (lane == lanes_.end()) lane = lanes_.begin();
    Lane& candidate = lane->second;
    if (!candidate.waiting || candidate.in_flight.size() >= limit_) continue;
    last_lane_ = lane->first;
    last_was_posed_ = true;
    candidate.in_flight.push_back({candidate.waiting_number, now});
    return std::exchange(candidate.waiting, nullptr);
  }
  return nullptr;
}

std::optional<Clock::time_point> Outbox::oldest_in_flight() const {
  std::optional<Clock::time_point> oldest;
  for (const auto& [id, lane] : lanes_) {
    if (!lane.in_flight.empty())
      oldest = std::min(oldest.value_or(Clock::time_point::max()), lane.in_flight.front().left);
  }
  return oldest;
}

}  // namespace ecorche::server
