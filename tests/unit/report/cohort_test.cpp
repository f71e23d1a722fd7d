// SPDX-License-Identifier: Apache-2.0
#include "app/report/cohort.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include <ecorche/values/error.hpp>
#include "app/report/cohort_page.hpp"

namespace ecorche::app::report {
namespace {

namespace fs = std::filesystem;

Participant someone(const std::string& name, double tets, double change = 0.01) {
  Participant one;
  one.name = name;
  one.state = Participant::State::warn;
  one.figures = {{"tets", tets}, {"joint_confidence", 0.9}};
  one.seconds = 2;
  one.peak_mib = 100;
  one.poses = {{"sitting", false, 1500, 0.001, change, 0.02, -1, 1, "<worst> of all"}};
  return one;
}

Participant somebody_failed(const std::string& name) {
  Participant one;
  one.name = name;
  one.state = Participant::State::failed;
  one.step = "check";
  one.fault = "data";
  one.where = "case.yaml:7";
  one.what = "a\ttab & <tag>";
  one.mend = "mend it";
  one.exit_code = 78;
  return one;
}

Participant nobody(const std::string& name) {
  Participant one;
  one.name = name;
  return one;
}

const Figure& figure(const std::vector<Figure>& all, const std::string& name) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const Figure& f) { return f.name == name; });
  EXPECT_NE(found, all.end()) << name;
  return *found;
}

TEST(CohortFigures, OutliersLieFarFromTheMedianInSpreads) {
  std::vector<Participant> cohort;
  for (const double tets : {100.0, 102.0, 98.0, 101.0, 99.0, 200.0, 150.0})
    cohort.push_back(someone("sub-x", tets));
  cohort.push_back(somebody_failed("sub-y"));
  const std::vector<Figure> all = figures_of(cohort);
  const Figure& tets = figure(all, "tets");
  EXPECT_EQ(tets.median, 101);
  EXPECT_NEAR(tets.spread, 1.4826 * 2, 1e-12);  // off by 1, 1, 3, 0, 2, 99, 49
  EXPECT_EQ(tets.outliers, (std::vector<std::size_t>{5, 6})) << "the farthest first";
  EXPECT_TRUE(std::isnan(tets.of[7]));
  EXPECT_TRUE(figure(all, "prepare_s").outliers.empty()) << "all the same";
  EXPECT_EQ(figure(all, "sitting.inverted_ml").of[0], 1.5);
}

TEST(CohortFigures, WhereMostAreTheSameTheMeanDeviationJudges) {
  std::vector<Participant> cohort;
  for (const double tets : {5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.5})
    cohort.push_back(someone("sub-x", tets));
  const std::vector<Figure> all = figures_of(cohort);
  EXPECT_NEAR(figure(all, "tets").spread, 1.2533 * 0.5 / 12, 1e-12);
  EXPECT_EQ(figure(all, "tets").outliers, (std::vector<std::size_t>{11}));
}

TEST(CohortFigures, OfFourNobodyIsUnlikeTheOthers) {
  std::vector<Participant> cohort;
  for (const double tets : {1.0, 1.1, 0.9, 1000.0}) cohort.push_back(someone("sub-x", tets));
  EXPECT_TRUE(figure(figures_of(cohort), "tets").outliers.empty());
  EXPECT_EQ(figures_of({}).size(), 6U);
}

TEST(CohortTable, EveryRowHasACellForEveryColumn) {
  const std::vector<Participant> cohort{someone("sub-01", 1000), somebody_failed("sub-02"), nobody("sub-03")};
  const std::string tsv = to_tsv(cohort, figures_of(cohort));
  std::vector<std::vector<std::string>> rows(1, std::vector<std::string>(1));
  for (const char c : tsv) {
    if (c == '\t') {
      rows.back().emplace_back();
    } else if (c == '\n') {
      rows.emplace_back(1);
    } else {
      rows.back().back() += c;
    }
  }
  rows.pop_back();
  ASSERT_EQ(rows.size(), 4U);
  for (const auto& row : rows) EXPECT_EQ(row.size(), rows[0].size());
  EXPECT_EQ(rows[1][1], "warn");
  EXPECT_EQ(rows[2][5], "case.yaml:7: a tab & <tag> (mend it)");
  EXPECT_EQ(rows[3][1], "unfinished");
  const auto json = nlohmann::json::parse(to_json(cohort, figures_of(cohort)));
  EXPECT_EQ(json["counts"], nlohmann::json({{"pass", 0}, {"warn", 1}, {"failed", 1}, {"unfinished", 1}}));
  EXPECT_EQ(json["participants"][1]["failed"]["exit_code"], 78);
  EXPECT_TRUE(json["participants"][1]["figures"]["tets"].is_null());
}

TEST(CohortPage, SaysEverythingAndLetsNothingBecomeMarkup) {
  const std::vector<Participant> cohort{someone("sub-01", 1000), somebody_failed("sub-02")};
  const std::string page = group_page(cohort, figures_of(cohort));
  EXPECT_NE(page.find("a?tab &amp; &lt;tag&gt;"), std::string::npos);
  EXPECT_NE(page.find("<td class=why data-of=reason>sitting"), std::string::npos);
  EXPECT_NE(pose_section(cohort[0]).find("&lt;worst&gt; of all"), std::string::npos);
  EXPECT_NE(page.find("href='sub-01/report.html'"), std::string::npos);
  EXPECT_EQ(page.find("http"), std::string::npos);
  EXPECT_NE(pose_section(cohort[0]).find("<td>sitting<td class=bad>warn"), std::string::npos);
  EXPECT_NE(failed_page(cohort[1]).find("exit 78"), std::string::npos);
}

class StatusFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder = fs::temp_directory_path() / ("cohort_test_" + std::to_string(::getpid())) / "sub-07";
    fs::create_directories(folder / "log");
  }
  void TearDown() override { fs::remove_all(folder.parent_path()); }
  void write(const fs::path& file, const std::string& text) const { std::ofstream(folder / file) << text; }

  const std::string good =
      R"({"participant": "sub-07", "ok": true, "failed": null, "figures": {"tets": 12}, "least_joint": "knee", "warnings": ["w"],
      "repaired": true, "poses": [{"pose": "a", "verdict": "pass", "inverted_rest_mm3": 1, "inverted_share": 0, "min_det_f": 1,
      "volume_change": 0, "unsigned_volume_change": 0, "warnings": 0, "worst": ""}],
      "left_out": [{"pose": "b", "why": "a <leg>"}]})";
  fs::path folder;
};

TEST_F(StatusFile, IsReadWithItsTimes) {
  EXPECT_EQ(read_participant(folder).state, Participant::State::unfinished);
  write("status.json", good);
  write("log/preprocess.time.json", R"({"seconds": 3.5, "peak_mib": 77, "attempt": 1})");
  const Participant one = read_participant(folder / "");
  EXPECT_EQ(one.name, "sub-07");
  EXPECT_EQ(one.state, Participant::State::pass);
  EXPECT_EQ(one.seconds, 3.5);
  EXPECT_EQ(one.figure("tets"), 12);
  EXPECT_TRUE(std::isnan(one.figure("nodes")));
  EXPECT_TRUE(one.repaired);
  ASSERT_EQ(one.left_out.size(), 1U);
  EXPECT_NE(pose_section(one).find("<td>b<td class=soft>left out<td colspan=4><td class=why>a &lt;leg&gt;"),
            std::string::npos);
  EXPECT_NE(group_page({one}, figures_of({one})).find("b <span class=soft>left out</span>"),
            std::string::npos);
  EXPECT_NE(to_json({one}, {}).find("a <leg>"), std::string::npos);
}

TEST_F(StatusFile, WhoCanTakeNoPoseDoesNotPass) {
  std::string none = good;
  none.replace(none.find(R"([{"pose": "a")"), none.find("\"left_out\"") - none.find(R"([{"pose": "a")"),
               "[], ");
  write("status.json", none);
  EXPECT_EQ(read_participant(folder).state, Participant::State::warn);
  write("status.json", none.replace(none.find(R"([{"pose": "b")"), std::string::npos, "[]}"));
  EXPECT_EQ(read_participant(folder).state, Participant::State::pass);
}

TEST_F(StatusFile, EveryPrefixOfOneIsRefusedByItsName) {
  for (std::size_t length = 0; length < good.size(); length += 3) {
    write("status.json", good.substr(0, length));
    try {
      read_participant(folder);
      FAIL() << length;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::data);
      EXPECT_NE(std::string(error.what()).find("status.json: is not the status"), std::string::npos);
    }
  }
  for (const char* text : {"[]", "3", "null", R"({"ok": "yes"})"}) {
    write("status.json", text);
    EXPECT_THROW(read_participant(folder), Error) << text;
  }
}

}  // namespace
}  // namespace ecorche::app::report
