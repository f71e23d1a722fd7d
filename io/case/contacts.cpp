// SPDX-License-Identifier: Apache-2.0
#include "io/case/contacts.hpp"

#include <array>

namespace ecorche::io {
namespace {

using yaml::Kind;
using yaml::Value;

constexpr std::array<std::string_view, 1> kContactKeys{"joined"};
constexpr std::size_t kMostPairs = 1000;

std::string read_segment(const Value& name, const Skeleton& skeleton) {
  if (skeleton.find_segment(name.text()) >= 0) return name.text();
  std::vector<std::string> known;
  for (const Segment& segment : skeleton.segments) known.push_back(segment.name);
  name.fail_unknown("segment", name.text(), known, "the skeleton has it not");
}

}  // namespace

CaseContacts read_contacts(const Value& value, const Skeleton& skeleton) {
  CaseContacts out;
  if (value.kind() != Kind::map) {
    if (value.text() != "cut" && value.text() != "joined")
      value.fail("'" + value.text() + "' says nothing of limbs that touch",
                 "use cut (they come apart), joined, or joined: [[hand_left, pelvis]]");
    out.cut = value.text() == "cut";
    return out;
  }
  value.allow(kContactKeys);
  const Value joined = value.at("joined");
  for (const Value& pair : joined.items()) {
    const std::vector<Value> two = pair.kind() == Kind::list ? pair.items() : std::vector<Value>{};
    if (two.size() != 2) pair.fail("is no pair", "name two segments, such as [hand_left, pelvis]");
    out.joined.emplace_back(read_segment(two[0], skeleton), read_segment(two[1], skeleton));
  }
  if (out.joined.empty() || out.joined.size() > kMostPairs)
    joined.fail("lists no pairs, or more than 1000", "list 1 to 1000");
  return out;
}

}  // namespace ecorche::io
