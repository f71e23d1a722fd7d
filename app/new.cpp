// SPDX-License-Identifier: Apache-2.0
// `ecorche new`: a scan in, a case out, with all that was decided in words.
#include <filesystem>

#include "app/command.hpp"
#include "app/read_budget.hpp"
#include "app/scan/case_folder.hpp"
#include "app/scan/scan_page.hpp"
#include "core/files/atomic_file.hpp"
#include "core/platform/heap.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

struct NewSettings {
  std::vector<fs::path> scan;
  fs::path output, report;
  std::string side;
  ScanOptions options;
  files::ReadLimits limits;
  io::ImageChoice choice;
};

nlohmann::json entry_json(const ScanEntry& entry) {
  nlohmann::json out{{"name", entry.name},
                     {"confidence", entry.confidence},
                     {"how", entry.how},
                     {"voxels", entry.voxels},
                     {"cut", entry.cut}};
  if (entry.role == ScanEntry::Role::bone) {
    out["segment"] = entry.segment;
  } else {
    out["group"] = group_name(entry.group);
  }
  return out;
}

int run(const Program& program, NewSettings& settings) {
  platform::use_big_heap();
  if (!settings.side.empty()) settings.options.side = settings.side == "left" ? Side::left : Side::right;
  check_case_target(settings.output, settings.scan);
  Scan scan =
      read_scan(settings.scan, reading(program, settings.limits), settings.choice, program.context("read"));
  const ScanCase made = decide(scan, settings.options, program.context("labels"));
  const WrittenCase written =
      write_scan_case(settings.output, settings.scan, scan, made, program.context("write"));
  if (!settings.report.empty()) files::write_text(settings.report, scan_page(made, written.name));
  nlohmann::json bones = nlohmann::json::array(), tissues = bones, labels = bones;
  for (const ScanEntry& entry : made.entries) {
    if (!entry.drawn || entry.voxels == 0) continue;
    if (entry.role == ScanEntry::Role::bone) bones.push_back(entry_json(entry));
    if (entry.role == ScanEntry::Role::tissue) tissues.push_back(entry_json(entry));
  }
  for (const LabelFate& fate : made.fates) {
    labels.push_back({{"file", fate.from},
                      {"name", fate.name},
                      {"voxels", fate.voxels},
                      {"became", fate.became},
                      {"how", fate.how},
                      {"confidence", fate.confidence}});
  }
  std::string text = (settings.output / "case.yaml").string() + ": " + std::to_string(bones.size()) +
                     " bones, " + std::to_string(tissues.size()) + " tissues, skin " + made.skin.how + "\n";
  for (const std::string& doubt : made.doubts) {
    program.warn();
    text += "warning: " + doubt + "\n";
  }
  for (const std::string& note : made.notes) text += "note: " + note + "\n";
  text += "Next: ecorche preprocess " + settings.output.string() + " -o " + settings.output.string() + ".hdf";
  program.result(
      text,
      {{"ok", true},
       {"case", (settings.output / "case.yaml").string()},
       {"bones", bones},
       {"tissues", tissues},
       {"labels", labels},
       {"skin", {{"how", made.skin.how}, {"confidence", made.skin.confidence}, {"caps", made.skin.caps}}},
       {"doubts", made.doubts},
       {"notes", made.notes}});
  return 0;
}

}  // namespace

void declare_new(CLI::App& app, Program& program, Run& chosen) {
  const auto settings = std::make_shared<NewSettings>();
  CLI::App* command =
      app.add_subcommand("new", "write the case of a scan: its CT and what programs segmented in it");
  command
      ->add_option(
          "SCAN", settings->scan,
          "images, label maps with names, tables of names, folders of masks or label maps, DICOM series and "
          "DICOM SEG; of labels that overlap the first file's count")
      ->required();
  command->add_option("-o,--output", settings->output, "the folder for the case; new, or empty")->required();
  command->add_option("--report", settings->report,
                      "write a page that shows what each label became, as one HTML file");
  command
      ->add_option("--side", settings->side,
                   "the side of a scan that shows one limb alone, where its labels do not say")
      ->check(CLI::IsMember({"left", "right"}));
  command
      ->add_option("--skin-hu", settings->options.skin_hu,
                   "HU: what is denser is the patient, where no label shows the body")
      ->check(CLI::Range(-1000.0, 200.0))
      ->capture_default_str();
  add_image_choice(*command, settings->choice);
  command->add_flag("--skin-from-labels", settings->options.skin_from_labels,
                    "draw the skin round all labels, where neither a label nor a CT shows it");
  add_read_budget(*command, settings->limits);
  command->callback(
      [&program, &chosen, settings] { chosen = [&program, settings] { return run(program, *settings); }; });
}

}  // namespace ecorche::app
