// SPDX-License-Identifier: Apache-2.0
// `ecorche report`: the pages of a cohort, from what its steps have written.
#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include <ecorche/model_file/model_file.hpp>
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/report/cohort_page.hpp"
#include "app/report/page.hpp"
#include "app/report/places.hpp"
#include "core/files/atomic_file.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using report::Participant;

constexpr int kThumbnail = 320;  // pixels of the longer side

struct ReportSettings {
  std::string level;
  fs::path folder;
  std::vector<std::string> names;
};

// As `preprocess --json` has told them.
std::vector<preprocess::StageTime> read_stages(const fs::path& file) {
  std::vector<preprocess::StageTime> out;
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return out;
  try {
    for (const nlohmann::json& stage : nlohmann::json::parse(files::read_text(file)))
      out.push_back({stage.at("name"), stage.at("seconds"), stage.at("peak_rss_mib"), stage.at("kept")});
  } catch (const nlohmann::json::exception&) {
    throw Error(ErrorKind::data, file.string(), "is not what `ecorche preprocess --json` prints as stages",
                "run the cohort again");
  }
  return out;
}

int report_participant(const Program& program, const ReportSettings& settings) {
  const fs::path& folder = settings.folder;
  const Participant one = report::read_participant(folder);
  if (one.state == Participant::State::unfinished) {
    throw Error(ErrorKind::missing_input, (folder / "status.json").string(), "is not there",
                "name a participant's folder of a cohort, as sub-01");
  }
  const fs::path page = folder / "report.html";
  if (one.state == Participant::State::failed) {
    files::write_text(page, report::failed_page(one));
  } else {
    const Model model = model_file::read((folder / "model.hdf").string(), program.context("read"));
    files::write_text(page, report::page({model, read_stages(folder / "log" / "stages.json"), one.warnings,
                                          report::pose_section(one)}));
    files::write_text(folder / "picture.png",
                      report::png_bytes(report::rig_pictures(model, kThumbnail).front().picture));
  }
  program.result(page.string(), {{"report", page.string()}, {"status", report::state_name(one.state)}});
  return 0;
}

int report_group(const Program& program, const ReportSettings& settings) {
  std::vector<std::string> names = settings.names;
  if (names.empty()) {
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(settings.folder, error)) {
      const std::string name = entry.path().filename().string();
      if (entry.is_directory(error) && name.starts_with("sub-")) names.push_back(name);
    }
  }
  if (names.empty()) {
    throw Error(ErrorKind::missing_input, settings.folder.string(), "holds no participant",
                "name a folder of results, with sub-01, sub-02, ... in it");
  }
  std::sort(names.begin(), names.end());
  std::vector<Participant> cohort;
  cohort.reserve(names.size());
  for (const std::string& name : names) cohort.push_back(report::read_participant(settings.folder / name));
  const std::vector<report::Figure> figures = report::figures_of(cohort);
  files::write_text(settings.folder / "group.tsv", report::to_tsv(cohort, figures));
  files::write_text(settings.folder / "group.json", report::to_json(cohort, figures));
  files::write_text(settings.folder / "group.html", report::group_page(cohort, figures));
  std::map<std::string, int> counts;
  for (const Participant& one : cohort) ++counts[report::state_name(one.state)];
  const fs::path page = settings.folder / "group.html";
  std::string text = page.string() + ": " + std::to_string(cohort.size()) + " participants";
  for (const auto& [state, count] : counts) text += ", " + std::to_string(count) + " " + state;
  program.result(text, {{"report", page.string()}, {"counts", counts}});
  return 0;
}

}  // namespace

void declare_report(CLI::App& app, Program& program, Run& chosen) {
  const auto settings = std::make_shared<ReportSettings>();
  CLI::App* command =
      app.add_subcommand("report", "write the pages of a cohort, from what its steps have written");
  command
      ->add_option("LEVEL", settings->level,
                   "participant: one folder's page; group: the page, table and JSON of all")
      ->required()
      ->check(CLI::IsMember({"participant", "group"}));
  command->add_option("FOLDER", settings->folder, "a participant's folder, or the cohort's")->required();
  command->add_option("NAME", settings->names, "of a group: who is in it (default: every folder sub-...)");
  command->callback([&program, &chosen, settings] {
    chosen = [&program, settings] {
      return settings->level == "group" ? report_group(program, *settings)
                                        : report_participant(program, *settings);
    };
  });
}

}  // namespace ecorche::app
