// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/presence.hpp"

#include <algorithm>
#include <string>
#include <tuple>
#include <vector>

namespace ecorche::server {

bool Presence::ask(const Member& member, bool asks) {
  return asks ? asking_.insert(&member).second : asking_.erase(&member) > 0;
}

void Presence::follow(const Control& control) {
  const auto& members = control.members();
  std::erase_if(asking_, [&](const Member* member) {
    const auto is = [&](const Member* one) { return one == member; };
    return control.controls(*member) || std::none_of(members.begin(), members.end(), is);
  });
}

v1::Members Presence::list(const Control& control) const {
  std::vector<const Member*> rows(control.members().begin(), control.members().end());
  const auto rank = [&](const Member* member) {
    return std::tuple(!control.controls(*member), !asks(*member), member->number());
  };
  std::sort(rows.begin(), rows.end(), [&](const Member* a, const Member* b) { return rank(a) < rank(b); });
  v1::Members out;
  for (const Member* row : rows) {
    if (out.members_size() == most_listed) break;
    v1::SessionMember& member = *out.add_members();
    member.set_connection(row->number());
    member.set_name(std::string(row->name()));
    member.set_role(control.controls(*row) ? v1::ROLE_CONTROLLER : v1::ROLE_OBSERVER);
    member.set_asks_control(asks(*row));
    member.set_takes_control(row->hears_of(v1::FEATURE_PRESENCE));
  }
  out.set_others(static_cast<std::uint32_t>(rows.size()) - static_cast<std::uint32_t>(out.members_size()));
  return out;
}

Member* find_member(const Control& control, std::uint64_t connection) {
  const auto& members = control.members();
  const auto found = std::find_if(members.begin(), members.end(),
                                  [&](const Member* member) { return member->number() == connection; });
  return found == members.end() ? nullptr : *found;
}

}  // namespace ecorche::server
