// SPDX-License-Identifier: Apache-2.0
#include "io/case/stiffness.hpp"

#include <algorithm>

namespace ecorche::io {
namespace {

using yaml::Kind;
using yaml::Value;

constexpr double kSoftest = 0.01, kStiffest = 1e6;  // kPa: below any tissue, above any that is no bone

}  // namespace

double read_stiffness(const Value& value) {
  const double kpa = value.number();
  if (!(kpa >= kSoftest && kpa <= kStiffest))
    value.fail(value.text() + " is out of range",
               "give Young's modulus in kPa, 0.01 to 1000000: fat has a few, muscle some tens");
  return kpa;
}

void read_stiffness_of_groups(const Value& value, std::size_t first, Case& patient) {
  const auto each = [&](auto&& f) {
    std::for_each(patient.tissues.begin() + static_cast<std::ptrdiff_t>(first), patient.tissues.end(), f);
  };
  if (value.kind() != Kind::map) {
    const double kpa = read_stiffness(value);
    each([&](CaseTissue& tissue) { tissue.stiffness_kpa = kpa; });
    return;
  }
  std::vector<std::string> known;
  each([&](CaseTissue& tissue) {
    const std::string group(group_name(tissue.group));
    if (std::find(known.begin(), known.end(), group) == known.end()) known.push_back(group);
  });
  for (const auto& [word, stiffness] : value.pairs()) {
    if (std::find(known.begin(), known.end(), word) == known.end())
      stiffness.fail_unknown("group", word, known, "no tissue of this entry is of it");
    const double kpa = read_stiffness(stiffness);
    each([&, &word = word](CaseTissue& tissue) {
      if (group_name(tissue.group) == word) tissue.stiffness_kpa = kpa;
    });
  }
}

void read_stiffness_of_flesh(const Value& root, Case& patient) {
  if (const auto value = root.find("stiffness_kpa")) {
    patient.stiffness_kpa = read_stiffness(*value);
    return;
  }
  const auto tissues = root.find("tissues");
  if (!tissues) return;
  for (const Value& entry : tissues->items()) {
    if (const auto value = entry.find("stiffness_kpa"))
      value->fail("the flesh about this tissue has none",
                  "give the case a stiffness_kpa, too: of flesh in no tissue that says its own");
  }
}

}  // namespace ecorche::io
