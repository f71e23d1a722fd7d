// SPDX-License-Identifier: Apache-2.0
#include "app/report/cohort.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include <ecorche/values/error.hpp>
#include "app/report/html.hpp"

namespace ecorche::app::report {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kFar = 3.5;  // spreads; IglewiczHoaglin93
constexpr std::size_t kLeastForOutliers = 5;

std::optional<std::string> bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return std::nullopt;
  std::ostringstream out;
  out << in.rdbuf();
  if (in.bad()) throw Error(ErrorKind::io, file.string(), "cannot be read", "check the disk");
  return out.str();
}

PosedRow posed_row(const Json& from) {
  PosedRow row;
  row.pose = from.at("pose");
  row.pass = from.at("verdict") == "pass";
  row.inverted_mm3 = from.at("inverted_rest_mm3");
  row.inverted_share = from.at("inverted_share");
  row.volume_change = from.at("volume_change");
  row.unsigned_volume_change = from.at("unsigned_volume_change");
  row.min_det_f = from.at("min_det_f");
  row.warnings = from.at("warnings");
  row.worst = from.at("worst");
  return row;
}

void read_status(const Json& status, Participant& out) {
  out.repaired = status.at("repaired");
  out.least_joint = status.at("least_joint");
  out.warnings = status.at("warnings").get<std::vector<std::string>>();
  for (const auto& [name, value] : status.at("figures").items())
    out.figures.emplace_back(name, value.is_number() ? value.get<double>() : kNone);
  for (const Json& row : status.at("poses")) out.poses.push_back(posed_row(row));
  for (const Json& row : status.value("left_out", Json::array()))
    out.left_out.push_back({row.at("pose"), row.at("why")});
  if (!status.at("ok")) {
    const Json& failed = status.at("failed");
    out.state = Participant::State::failed;
    out.step = failed.at("step");
    out.fault = failed.at("fault");
    out.where = failed.at("where");
    out.what = failed.at("what");
    out.mend = failed.at("mend");
    out.exit_code = failed.at("exit_code");
    return;
  }
  const bool pass =
      std::all_of(out.poses.begin(), out.poses.end(), [](const PosedRow& row) { return row.pass; });
  const bool posed = !out.poses.empty() || out.left_out.empty();
  out.state = pass && posed ? Participant::State::pass : Participant::State::warn;
}

double median_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

void judge_spread(Figure& figure) {
  std::vector<double> known;
  std::copy_if(figure.of.begin(), figure.of.end(), std::back_inserter(known),
               [](double x) { return std::isfinite(x); });
  if (known.empty()) return;
  figure.median = median_of(known);
  double sum = 0;
  for (double& x : known) sum += x = std::abs(x - figure.median);
  figure.spread = 1.4826 * median_of(known);
  if (figure.spread == 0) figure.spread = 1.2533 * sum / static_cast<double>(known.size());
  if (known.size() < kLeastForOutliers || figure.spread == 0) return;
  const auto off = [&](std::size_t i) { return std::abs(figure.of[i] - figure.median) / figure.spread; };
  for (std::size_t i = 0; i < figure.of.size(); ++i) {
    if (std::isfinite(figure.of[i]) && off(i) > kFar) figure.outliers.push_back(i);
  }
  std::stable_sort(figure.outliers.begin(), figure.outliers.end(),
                   [&](std::size_t a, std::size_t b) { return off(a) > off(b); });
}

std::string cell(double value) {
  return std::isfinite(value) ? text("%.9g", value) : "n/a";
}

// Tabs and ends of lines would end a cell.
std::string cell(std::string value) {
  std::replace_if(
      value.begin(), value.end(), [](char c) { return c == '\t' || c == '\n' || c == '\r'; }, ' ');
  return value.empty() ? "n/a" : value;
}

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json();
}

}  // namespace

double Participant::figure(const std::string& of) const {
  const auto found =
      std::find_if(figures.begin(), figures.end(), [&](const auto& one) { return one.first == of; });
  return found == figures.end() ? kNone : found->second;
}

const char* state_name(Participant::State state) {
  switch (state) {
    case Participant::State::pass:
      return "pass";
    case Participant::State::warn:
      return "warn";
    case Participant::State::failed:
      return "failed";
    case Participant::State::unfinished:
      break;
  }
  return "unfinished";
}

Participant read_participant(const fs::path& folder) {
  Participant out;
  out.name = (folder.has_filename() ? folder : folder.parent_path()).filename().string();
  const auto status = bytes_of(folder / "status.json");
  if (!status) return out;
  try {
    read_status(Json::parse(*status), out);
    if (const auto time = bytes_of(folder / "log" / "preprocess.time.json");
        time && out.state != Participant::State::failed) {
      const Json measured = Json::parse(*time);
      out.seconds = measured.at("seconds");
      out.peak_mib = measured.at("peak_mib");
    }
  } catch (const Json::exception&) {
    throw Error(ErrorKind::data, (folder / "status.json").string(), "is not the status that a cohort writes",
                "remove the participant's folder and run the cohort again");
  }
  if (out.state != Participant::State::failed) out.picture = bytes_of(folder / "picture.png").value_or("");
  return out;
}

std::vector<Figure> figures_of(const std::vector<Participant>& cohort) {
  std::vector<Figure> out{{"prepare_s", "Preparation", "s", 1, {}},
                          {"peak_mib", "Memory of the preparation", "MiB", 1, {}},
                          {"tets", "Tets", "", 1, {}},
                          {"row_sum_error", "Weights: largest error of a row's sum", "", 1, {}},
                          {"repaired_rows", "Weights: rows repaired", "", 1, {}},
                          {"joint_confidence", "Least confidence of a joint", "", 1, {}}};
  for (Figure& figure : out) {
    for (const Participant& one : cohort)
      figure.of.push_back(figure.name == "prepare_s"  ? one.seconds
                          : figure.name == "peak_mib" ? one.peak_mib
                                                      : one.figure(figure.name));
  }
  // Poses in the order in which participants have them; others may lack some.
  std::vector<std::string> poses;
  for (const Participant& one : cohort) {
    for (const PosedRow& row : one.poses) {
      if (std::find(poses.begin(), poses.end(), row.pose) == poses.end()) poses.push_back(row.pose);
    }
  }
  for (const std::string& pose : poses) {
    Figure inverted{pose + ".inverted_ml", pose + ": inverted", "ml", 1, {}};
    Figure change{pose + ".volume_change", pose + ": change of volume", "%", 100, {}};
    for (const Participant& one : cohort) {
      const auto row =
          std::find_if(one.poses.begin(), one.poses.end(), [&](const PosedRow& r) { return r.pose == pose; });
      inverted.of.push_back(row == one.poses.end() ? kNone : row->inverted_mm3 / 1000);
      change.of.push_back(row == one.poses.end() ? kNone : row->volume_change);
    }
    out.push_back(std::move(inverted));
    out.push_back(std::move(change));
  }
  for (Figure& figure : out) judge_spread(figure);
  return out;
}

std::string to_tsv(const std::vector<Participant>& cohort, const std::vector<Figure>& figures) {
  std::string out = "participant_id\tstatus\tstep\tfault\texit_code\terror\trepaired\tleast_joint\twarnings";
  for (const Figure& figure : figures) out += "\t" + cell(figure.name);
  out += "\n";
  for (std::size_t i = 0; i < cohort.size(); ++i) {
    const Participant& one = cohort[i];
    const bool failed = one.state == Participant::State::failed;
    out += cell(one.name) + "\t" + state_name(one.state) + "\t" + cell(one.step) + "\t" + cell(one.fault) +
           "\t" + (failed ? std::to_string(one.exit_code) : "n/a") + "\t" +
           (failed ? cell(one.where + ": " + one.what + " (" + one.mend + ")") : "n/a") + "\t" +
           (one.repaired ? "yes" : "no") + "\t" + cell(one.least_joint) + "\t" +
           std::to_string(one.warnings.size());
    for (const Figure& figure : figures) out += "\t" + cell(figure.of[i]);
    out += "\n";
  }
  return out;
}

std::string to_json(const std::vector<Participant>& cohort, const std::vector<Figure>& figures) {
  Json people = Json::array(), all = Json::array();
  std::map<std::string, int> counts{{"pass", 0}, {"warn", 0}, {"failed", 0}, {"unfinished", 0}};
  for (std::size_t i = 0; i < cohort.size(); ++i) {
    const Participant& one = cohort[i];
    ++counts[state_name(one.state)];
    Json row{{"participant_id", one.name},     {"status", state_name(one.state)}, {"repaired", one.repaired},
             {"least_joint", one.least_joint}, {"warnings", one.warnings},        {"poses", Json::array()},
             {"left_out", Json::array()}};
    for (const PosedRow& pose : one.poses) {
      row["poses"].push_back({{"pose", pose.pose},
                              {"verdict", pose.pass ? "pass" : "warn"},
                              {"inverted_mm3", pose.inverted_mm3},
                              {"inverted_share", pose.inverted_share},
                              {"volume_change", pose.volume_change},
                              {"unsigned_volume_change", pose.unsigned_volume_change},
                              {"min_det_f", pose.min_det_f},
                              {"warnings", pose.warnings},
                              {"worst", pose.worst}});
    }
    for (const LeftOutPose& pose : one.left_out)
      row["left_out"].push_back({{"pose", pose.pose}, {"why", pose.why}});
    if (one.state == Participant::State::failed) {
      row["failed"] = {{"step", one.step},   {"fault", one.fault}, {"exit_code", one.exit_code},
                       {"where", one.where}, {"what", one.what},   {"mend", one.mend}};
    }
    for (const Figure& figure : figures) row["figures"][figure.name] = number(figure.of[i]);
    people.push_back(std::move(row));
  }
  for (const Figure& figure : figures) {
    Json outliers = Json::array();
    for (const std::size_t i : figure.outliers) outliers.push_back(cohort[i].name);
    all.push_back({{"name", figure.name},
                   {"median", figure.median},
                   {"spread", figure.spread},
                   {"outliers", outliers}});
  }
  const Json out{{"ecorche_group", 1},
                 {"counts", counts},
                 {"participants", std::move(people)},
                 {"figures", std::move(all)},
                 {"purpose", "training and education, not planning of surgery"}};
  return out.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace ecorche::app::report
