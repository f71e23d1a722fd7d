// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/net/flow.hpp"

#include <algorithm>

namespace ecorche::server {
namespace {

using std::chrono::milliseconds;
constexpr Clock::duration kSpell = std::chrono::seconds(10);
constexpr Clock::duration kLeastLate = milliseconds(40), kMostLate = milliseconds(100);
constexpr Clock::duration kAlwaysLate = milliseconds(180);
constexpr Clock::duration kLongestGap = milliseconds(500);
constexpr Clock::duration kLongestPatience = std::chrono::seconds(16);
constexpr int kLateOnes = 2;  // a single one may be a lost packet

}  // namespace

void Flow::left(std::uint64_t number, Clock::time_point now) {
  in_flight_.push_back({number, now});
}

void Flow::written(Clock::time_point now) {
  for (auto frame = in_flight_.rbegin(); frame != in_flight_.rend() && !frame->written; ++frame)
    frame->written = now;
}

void Flow::arrived(std::uint64_t number, Clock::time_point now) {
  while (!in_flight_.empty() && in_flight_.front().number <= number) {
    judge(now - in_flight_.front().left, now);
    in_flight_.pop_front();
  }
}

std::optional<Clock::time_point> Flow::oldest() const {
  if (in_flight_.empty()) return std::nullopt;
  return in_flight_.front().left;
}

std::optional<Clock::time_point> Flow::oldest_written() const {
  if (in_flight_.empty()) return std::nullopt;
  return in_flight_.front().written;
}

bool Flow::may_leave(Clock::time_point now) const {
  if (in_flight_.size() < few_) return true;
  if (in_flight_.size() >= most_in_flight || !shortest_) return false;
  return now - in_flight_.front().left <= *shortest_ * 3 / 2;
}

Clock::duration Flow::longest_gap() const {
  return std::min(2 * shortest_.value_or(Clock::duration()), kLongestGap);
}

Clock::duration Flow::late() const {
  const Clock::duration way = shortest_.value_or(kLeastLate);
  const Clock::duration late = way + std::clamp(way, kLeastLate, kMostLate);
  return level_ < most_ ? std::min(late, kAlwaysLate) : late;
}

void Flow::judge(Clock::duration delay, Clock::time_point now) {
  if (now - spell_ > kSpell) {
    spell_ = now;
    if (next_shortest_) shortest_ = next_shortest_;
    next_shortest_.reset();
  }
  next_shortest_ = std::min(next_shortest_.value_or(delay), delay);
  shortest_ = std::min(shortest_.value_or(delay), delay);
  if (delay > late()) {
    prompt_since_.reset();
    if (++late_ones_ >= kLateOnes) coarser(delay, now);
    return;
  }
  late_ones_ = 0;
  if (delay > (*shortest_ + late()) / 2) {
    prompt_since_.reset();
  } else if (!prompt_since_) {
    prompt_since_ = now;
  }
}

void Flow::coarser(Clock::duration delay, Clock::time_point now) {
  // What left before the last change says nothing about it.
  if (!in_flight_.empty() && in_flight_.front().left < changed_) return;
  if (finer_at_ && now - *finer_at_ < patience_) patience_ = std::min(2 * patience_, kLongestPatience);
  finer_at_.reset();
  // Each level is a quarter of the bytes, and the delay's excess is theirs.
  Clock::duration excess = delay - std::min(delay, late() / 2);
  while (level_ < most_ && excess > kLeastLate) {
    ++level_;
    excess /= 4;
  }
  late_ones_ = 0;
  prompt_since_.reset();
  changed_ = now;
}

std::uint32_t Flow::level(std::uint32_t finest, std::uint32_t coarsest, Clock::time_point now) {
  most_ = coarsest - finest;
  // What is overdue is late already.
  if (!in_flight_.empty() && now - in_flight_.front().left > late() + kLeastLate)
    coarser(now - in_flight_.front().left, now);
  if (level_ > 0 && prompt_since_ && now - *prompt_since_ > patience_) {
    --level_;
    finer_at_ = changed_ = now;
    prompt_since_.reset();
  }
  return finest + level_;
}

}  // namespace ecorche::server
