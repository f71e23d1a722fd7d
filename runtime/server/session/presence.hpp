// SPDX-License-Identifier: Apache-2.0
// Who is in a session, as its members see it, and who of them asks for control.
#pragma once

#include <cstdint>
#include <set>

#include "runtime/server/session/control.hpp"

namespace ecorche::server {

/// Plain bookkeeping beside Control, whose members these are.
class Presence {
 public:
  /// As many are listed; the others are counted.
  static constexpr int most_listed = 64;

  /// The member asks whoever holds control for it, or asks no more. False where nothing changed by that.
  bool ask(const Member& member, bool asks);
  bool asks(const Member& member) const { return asking_.contains(&member); }
  /// Members or control have changed: who left, or has it now, asks no more. Throws nothing.
  void follow(const Control& control);

  v1::Members list(const Control& control) const;

 private:
  std::set<const Member*> asking_;
};

/// The member of this connection; null where it is not here.
Member* find_member(const Control& control, std::uint64_t connection);

}  // namespace ecorche::server
