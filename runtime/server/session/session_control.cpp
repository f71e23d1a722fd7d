// SPDX-License-Identifier: Apache-2.0
// Who is in a session, and who of them poses.
#include <utility>

#include "runtime/server/session/session.hpp"

namespace ecorche::server {

bool Session::reserved(Clock::time_point now) const {
  return !controller_ && control_left_ && now - *control_left_ < duration(limits_.linger_seconds);
}

void Session::take_control(Member& member) {
  controller_ = &member;
  control_left_.reset();
  awaits_heir_ = false;
}

v1::Role Session::join(Member& member, bool heir) {
  members_.insert(&member);
  if (!controller_ && (!reserved(Clock::now()) || (heir && awaits_heir_))) {
    take_control(member);
    tell_control(&member);
  }
  return controller_ == &member ? v1::ROLE_CONTROLLER : v1::ROLE_OBSERVER;
}

v1::Role Session::rejoin(Member& member, bool control) {
  if (!control || controller_) return join(member);
  members_.insert(&member);
  take_control(member);
  tell_control(&member);
  return v1::ROLE_CONTROLLER;
}

void Session::await_heir() {
  control_left_ = Clock::now();
  awaits_heir_ = true;
}

void Session::leave(Member& member, bool may_return) {
  members_.erase(&member);
  for (Row& row : rows_) {
    row.members.erase(&member);
    if (row.members.empty()) drop(row);
  }
  std::erase_if(rows_, [](const Row& row) { return row.members.empty(); });
  stop_unwatched();
  const auto now = Clock::now();
  const bool controlled = controller_ == &member;
  if (controlled) {
    controller_ = nullptr;
    uncontrolled_ = now;
    control_left_.reset();
    if (may_return) control_left_ = now;
  }
  if (members_.empty()) {
    last_seen_ = now;
    awaited_ = may_return;
    player_->stop();
    keep_time();  // a server that stops would wait for who watches at the slowest rate
    forget_probes(now);
  } else if (controlled) {
    tell_control();
  }
}

bool Session::claim(Member& member) {
  if (controller_ == &member) return true;
  if (controller_ || reserved(Clock::now())) return false;
  take_control(member);
  tell_control();
  return true;
}

bool Session::release(Member& member) {
  if (controller_ != &member) return false;
  controller_ = nullptr;
  uncontrolled_ = Clock::now();
  control_left_.reset();
  tell_control();
  return true;
}

void Session::free_control(Clock::time_point now) {
  if (controller_ || !control_left_ || reserved(now)) return;
  control_left_.reset();
  awaits_heir_ = false;
  tell_control();
}

void Session::tell_control(const Member* but) {
  const auto now = Clock::now();
  const bool kept = reserved(now);
  const double left = kept ? seconds(*control_left_ + duration(limits_.linger_seconds) - now) : 0;
  for (Member* member : members_) {
    if (member == but) continue;
    member->control_changed(controller_ == member ? v1::ROLE_CONTROLLER : v1::ROLE_OBSERVER,
                            !controller_ && !kept, left);
  }
}

}  // namespace ecorche::server
