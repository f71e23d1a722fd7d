// SPDX-License-Identifier: Apache-2.0
// Who is in a session, and who of them poses.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <utility>

#include "runtime/server/net/asio.hpp"
#include "runtime/server/session/member.hpp"

namespace ecorche::server {

/// At most one member has control: the first, until it leaves or releases it. Whoever left and may come back
/// has it reserved for a while. Members hear of every change. Plain bookkeeping; every time comes from the
/// caller.
class Control {
 public:
  /// `linger`: so long a place is kept for who left. `now`: since when nobody is here.
  Control(Clock::duration linger, Clock::time_point now) : linger_(linger), empty_since_(now) {}

  /// `changed` is called after every change of members or control. It throws nothing.
  void on_change(std::function<void()> changed) { changed_ = std::move(changed); }

  /// Gives control to the member where it is free and sought; to an `heir` also where it is reserved for one.
  v1::Role join(Member& member, bool heir, Clock::time_point now);
  /// As join; with `control`, the control that it left with is its again, unless somebody has it.
  v1::Role rejoin(Member& member, bool control, Clock::time_point now);
  /// `may_return`: its control is reserved for it. Throws nothing.
  void leave(Member& member, bool may_return, Clock::time_point now);
  /// Control is reserved for who held it in the session of this name before (join's heir).
  void await_heir(Clock::time_point now);

  /// False while another holds control, or may come back to it.
  bool claim(Member& member, Clock::time_point now);
  /// False where the member does not hold it.
  bool release(Member& member, Clock::time_point now);
  /// From who holds it to another member. False where `from` does not hold it.
  bool transfer(Member& from, Member& to, Clock::time_point now);
  /// Tells all once control is free that was reserved.
  void expire(Clock::time_point now);

  const std::set<Member*>& members() const { return members_; }
  Member* controller() const { return controller_; }
  bool controls(const Member& member) const { return controller_ == &member; }
  /// Somebody holds control, or it is reserved for somebody.
  bool taken(Clock::time_point now) const { return controller_ != nullptr || reserved(now); }
  /// Since when nobody controls it; somebody does where there is a controller.
  Clock::time_point uncontrolled_since() const { return uncontrolled_since_; }

  /// Since when nobody is here.
  std::optional<Clock::time_point> empty_since() const;
  /// The member that left last may come back.
  bool awaits_return() const { return awaits_return_; }

 private:
  bool reserved(Clock::time_point now) const;
  void give(Member& member);
  void notify(Clock::time_point now, const Member* but = nullptr) const;
  void tell_change() const {
    if (changed_) changed_();
  }

  Clock::duration linger_;
  std::function<void()> changed_;
  std::set<Member*> members_;
  Member* controller_ = nullptr;
  std::optional<Clock::time_point> reserved_since_;  ///< for the last controller
  bool awaits_heir_ = false;                         ///< which was one of the session that was before
  bool awaits_return_ = false;
  Clock::time_point uncontrolled_since_{};
  Clock::time_point empty_since_;
};

}  // namespace ecorche::server
