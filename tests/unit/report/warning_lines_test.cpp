// SPDX-License-Identifier: Apache-2.0
#include "app/report/warning_lines.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <string>

namespace ecorche::app {
namespace {

using nlohmann::json;

json fold(const std::string& what, double x) {
  return {{"kind", "tissue_change"},
          {"what", what},
          {"at_mm", {x, 2.0, 3.0}},
          {"joint", "hip"},
          {"mend", "turn less"}};
}

json doubtful(const std::string& joint, double degrees, double confidence) {
  return {{"kind", "doubtful_joint"}, {"what", joint + " turns"}, {"joint", joint},   {"value", degrees},
          {"confidence", confidence}, {"at_mm", {1.0, 1.0, 1.0}}, {"mend", "give it"}};
}

TEST(WarningLines, OnePlaceIsOneLine) {
  const json warnings{fold("a", 1), fold("b", 1), fold("c", 9), fold("d", 1)};
  EXPECT_EQ(warning_lines(warnings),
            "  warning: a; b; d, at [1, 2, 3] mm of the scan by hip (turn less)\n"
            "  warning: c, at [9, 2, 3] mm of the scan by hip (turn less)\n");
}

TEST(WarningLines, JointsThatWereFoundBadlyAreOneLine) {
  EXPECT_EQ(warning_lines(json{doubtful("knee", 30, 0.4)}),
            "  warning: knee turns, at [1, 1, 1] mm of the scan by knee (give it)\n");
  json warnings;
  for (const char* joint : {"a", "b", "c", "d", "e"}) warnings.push_back(doubtful(joint, 30, 0.1));
  warnings.push_back(fold("f", 1));
  EXPECT_EQ(
      warning_lines(warnings),
      "  warning: 5 joints turn though they were found with a confidence of at most 0.10: a by 30 degrees, "
      "b by 30 degrees, c by 30 degrees, d by 30 degrees and 1 more (give it)\n"
      "  warning: f, at [1, 2, 3] mm of the scan by hip (turn less)\n");
}

TEST(WarningLines, FourLinesAndHowManyMore) {
  json warnings;
  for (int i = 0; i < 6; ++i) warnings.push_back(fold("w", i));
  warnings.push_back({{"kind", "bone_rigidity"}, {"what", "bends"}, {"mend", "verify"}});
  const std::string text = warning_lines(warnings);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 5);
  EXPECT_NE(text.find("  and 3 more warnings, in quality.json\n"), text.npos);
  EXPECT_EQ(warning_lines(json::array()), "");
}

}  // namespace
}  // namespace ecorche::app
