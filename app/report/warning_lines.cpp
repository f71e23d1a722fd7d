// SPDX-License-Identifier: Apache-2.0
#include "app/report/warning_lines.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace ecorche::app {
namespace {

using nlohmann::json;

constexpr std::size_t kMostLines = 4;  // the others stand in quality.json
constexpr std::size_t kMostJoints = 4;

using Group = std::vector<const json*>;

bool doubtful(const json& warning) {
  return warning["kind"] == "doubtful_joint";
}

// What one line can tell: all joints that were found badly, or what has one place and one way out.
bool belong_together(const json& a, const json& b) {
  if (doubtful(a) || doubtful(b)) return doubtful(a) && doubtful(b);
  return a.contains("at_mm") && b.contains("at_mm") && a["at_mm"] == b["at_mm"] && a["mend"] == b["mend"];
}

std::vector<Group> grouped(const json& warnings) {
  std::vector<Group> out;
  for (const json& warning : warnings) {
    const auto like = std::find_if(
        out.begin(), out.end(), [&](const Group& group) { return belong_together(*group.front(), warning); });
    if (like == out.end())
      out.push_back({&warning});
    else
      like->push_back(&warning);
  }
  return out;
}

std::string joints(const Group& group) {
  double most = 0;
  for (const json* warning : group) most = std::max(most, (*warning)["confidence"].get<double>());
  std::string out = fmt::format(
      "{} joints turn though they were found with a confidence of at most {:.2f}:", group.size(), most);
  for (std::size_t i = 0; i < std::min(kMostJoints, group.size()); ++i)
    out += fmt::format("{} {} by {:.0f} degrees", i == 0 ? "" : ",", (*group[i])["joint"].get<std::string>(),
                       std::abs((*group[i])["value"].get<double>()));
  if (group.size() > kMostJoints) out += fmt::format(" and {} more", group.size() - kMostJoints);
  return out;
}

std::string place(const json& warning) {
  const json& at = warning["at_mm"];
  std::string out = fmt::format(", at [{:.0f}, {:.0f}, {:.0f}] mm of the scan", at[0].get<double>(),
                                at[1].get<double>(), at[2].get<double>());
  if (warning.contains("joint")) out += " by " + warning["joint"].get<std::string>();
  return out;
}

std::string line_of(const Group& group) {
  const json& first = *group.front();
  std::string out = "  warning: ";
  if (doubtful(first) && group.size() > 1) {
    out += joints(group);
  } else {
    for (const json* warning : group)
      out += (warning == &first ? "" : "; ") + (*warning)["what"].get<std::string>();
    if (first.contains("at_mm")) out += place(first);
  }
  return out + " (" + first["mend"].get<std::string>() + ")\n";
}

}  // namespace

std::string warning_lines(const json& warnings) {
  const std::vector<Group> groups = grouped(warnings);
  std::string out;
  std::size_t told = 0;
  for (std::size_t g = 0; g < std::min(kMostLines, groups.size()); ++g) {
    out += line_of(groups[g]);
    told += groups[g].size();
  }
  if (told < warnings.size())
    out += fmt::format("  and {} more warnings, in quality.json\n", warnings.size() - told);
  return out;
}

}  // namespace ecorche::app
