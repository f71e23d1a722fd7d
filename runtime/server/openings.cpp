// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/openings.hpp"

#include <algorithm>

#include "runtime/server/session.hpp"

namespace ecorche::server {

void Openings::ask(const std::shared_ptr<Session>& session) {
  waiting_.push_back(session);  // before its session takes it for done: there may be no memory
  if (session->await_opening()) waiting_.pop_back();
  next();
}

void Openings::next() {
  while (!busy_ && !stopped_ && !waiting_.empty()) {
    std::erase_if(waiting_, [](const auto& one) { return one.expired(); });
    const auto least = std::min_element(waiting_.begin(), waiting_.end(), [](const auto& a, const auto& b) {
      const std::shared_ptr<Session> one = a.lock(), other = b.lock();
      return one && other && one->account()->used() < other->account()->used();
    });
    if (least == waiting_.end()) return;
    const std::shared_ptr<Session> session = least->lock();
    waiting_.erase(least);
    busy_ = session && session->open_up();
  }
}

void Openings::done() {
  busy_ = false;
  next();
}

}  // namespace ecorche::server
