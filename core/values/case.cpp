// SPDX-License-Identifier: Apache-2.0
#include <ecorche/values/case.hpp>

#include <array>

#include <ecorche/values/error.hpp>

namespace ecorche {

namespace {
constexpr std::array<std::string_view, 10> kGroups{"skin",  "bone",      "muscle",   "organ", "vessel",
                                                   "nerve", "cartilage", "ligament", "fat",   "other"};
}

std::string_view group_name(Group group) {
  return kGroups.at(static_cast<std::size_t>(group));
}

Group group_from_name(std::string_view name) {
  for (std::size_t i = 0; i < kGroups.size(); ++i) {
    if (kGroups[i] == name) return static_cast<Group>(i);
  }
  throw Error(ErrorKind::config, "group", "unknown group '" + std::string(name) + "'",
              "use skin, bone, muscle, organ, vessel, nerve, cartilage, ligament, fat or other");
}

}  // namespace ecorche
