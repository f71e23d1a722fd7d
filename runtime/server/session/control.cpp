// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/control.hpp"

namespace ecorche::server {

bool Control::reserved(Clock::time_point now) const {
  return !controller_ && reserved_since_ && now - *reserved_since_ < linger_;
}

void Control::give(Member& member) {
  controller_ = &member;
  reserved_since_.reset();
  awaits_heir_ = false;
}

v1::Role Control::join(Member& member, bool heir, Clock::time_point now) {
  members_.insert(&member);
  if (!controller_ && member.seeks_control() && (!reserved(now) || (heir && awaits_heir_))) {
    give(member);
    notify(now, &member);
  }
  tell_change();
  return controller_ == &member ? v1::ROLE_CONTROLLER : v1::ROLE_OBSERVER;
}

v1::Role Control::rejoin(Member& member, bool control, Clock::time_point now) {
  if (!control || controller_ || !member.may_control()) return join(member, false, now);
  members_.insert(&member);
  give(member);
  notify(now, &member);
  tell_change();
  return v1::ROLE_CONTROLLER;
}

void Control::await_heir(Clock::time_point now) {
  reserved_since_ = now;
  awaits_heir_ = true;
}

void Control::leave(Member& member, bool may_return, Clock::time_point now) {
  members_.erase(&member);
  const bool controlled = controller_ == &member;
  if (controlled) {
    controller_ = nullptr;
    uncontrolled_since_ = now;
    reserved_since_.reset();
    if (may_return) reserved_since_ = now;
  }
  if (members_.empty()) {
    empty_since_ = now;
    awaits_return_ = may_return;
  } else if (controlled) {
    notify(now);
  }
  tell_change();
}

bool Control::claim(Member& member, Clock::time_point now) {
  if (controller_ == &member) return true;
  if (controller_ || reserved(now)) return false;
  give(member);
  notify(now);
  tell_change();
  return true;
}

bool Control::transfer(Member& from, Member& to, Clock::time_point now) {
  if (controller_ != &from) return false;
  give(to);
  notify(now);
  tell_change();
  return true;
}

bool Control::release(Member& member, Clock::time_point now) {
  if (controller_ != &member) return false;
  controller_ = nullptr;
  uncontrolled_since_ = now;
  reserved_since_.reset();
  notify(now);
  tell_change();
  return true;
}

void Control::expire(Clock::time_point now) {
  if (controller_ || !reserved_since_ || reserved(now)) return;
  reserved_since_.reset();
  awaits_heir_ = false;
  notify(now);
}

std::optional<Clock::time_point> Control::empty_since() const {
  if (!members_.empty()) return std::nullopt;
  return empty_since_;
}

void Control::notify(Clock::time_point now, const Member* but) const {
  const bool kept = reserved(now);
  const double left = kept ? seconds(*reserved_since_ + linger_ - now) : 0;
  for (Member* member : members_) {
    if (member == but) continue;
    member->control_changed(controller_ == member ? v1::ROLE_CONTROLLER : v1::ROLE_OBSERVER,
                            !controller_ && !kept, left);
  }
}

}  // namespace ecorche::server
