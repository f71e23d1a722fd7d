// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/openings.hpp"

#include "runtime/server/session.hpp"

namespace ecorche::server {

void Openings::ask(const std::shared_ptr<Session>& session) {
  waiting_.push_back(session);  // before its session takes it for done: there may be no memory
  if (session->await_opening()) waiting_.pop_back();
  next();
}

void Openings::next() {
  while (!busy_ && !stopped_ && !waiting_.empty()) {
    const std::shared_ptr<Session> session = waiting_.front().lock();
    waiting_.pop_front();
    busy_ = session && session->open_up();
  }
}

void Openings::done() {
  busy_ = false;
  next();
}

}  // namespace ecorche::server
