// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/schedule/turn_queue.hpp"

#include <algorithm>

namespace ecorche::server {

void TurnQueue::ask(const std::shared_ptr<Turn>& turn) {
  waiting_.push_back(turn);  // before it is taken for awaited: there may be no memory
  if (std::exchange(turn->awaited_, true)) waiting_.pop_back();
  next();
}

// The next one, no longer in the queue; null where its owner is gone.
std::shared_ptr<Turn> TurnQueue::take() {
  auto found = waiting_.begin();
  if (order_ == Order::least_used)
    found = std::min_element(waiting_.begin(), waiting_.end(), [](const auto& a, const auto& b) {
      const std::shared_ptr<Turn> one = a.lock(), other = b.lock();
      return one && other && one->account_->used() < other->account_->used();
    });
  std::shared_ptr<Turn> turn = found->lock();
  waiting_.erase(found);
  return turn;
}

void TurnQueue::next() {
  while (!busy_ && !resting_ && !stopped_) {
    std::erase_if(waiting_, [](const auto& one) { return one.expired(); });
    if (waiting_.empty()) return;
    const std::shared_ptr<Turn> turn = take();
    if (!turn) continue;
    turn->awaited_ = false;
    busy_ = turn->begin_();
  }
}

void TurnQueue::stop() {
  stopped_ = true;
  timer_.cancel();
}

void TurnQueue::done(Clock::duration cost) {
  busy_ = false;
  if (pause_ == 0) return next();
  if (stopped_) return;
  timer_.expires_after(pause_ * cost);
  timer_.async_wait([this](const boost::system::error_code& ec) {
    if (ec) return;
    resting_ = false;
    next();
  });
  resting_ = true;
}

}  // namespace ecorche::server
