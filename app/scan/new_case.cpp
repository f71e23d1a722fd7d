// SPDX-License-Identifier: Apache-2.0
#include "app/scan/new_case.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/cli.hpp"
#include "app/scan/unread_files.hpp"

namespace ecorche::app {
namespace {

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

bool is_drawn(const ScanEntry& entry) {
  return entry.drawn && entry.voxels > 0;
}

}  // namespace

const char* const kScanHelp =
    "images, label maps with names, tables of names, folders of masks or label maps, DICOM series and "
    "DICOM SEG; of labels that overlap the first file's count";

std::vector<CLI::Option*> add_scan_options(CLI::App& command, ScanSettings& settings) {
  std::vector<CLI::Option*> out;
  out.push_back(command
                    .add_option("--side", settings.side,
                                "the side of a scan that shows one limb alone, where its labels do not say")
                    ->check(CLI::IsMember({"left", "right"})));
  out.push_back(command
                    .add_option("--skin-hu", settings.options.skin_hu,
                                "HU: what is denser is the patient, where no label shows the body")
                    ->check(CLI::Range(-1000.0, 200.0))
                    ->each([&settings](const std::string&) { settings.skin_given = true; })
                    ->capture_default_str());
  out.push_back(command
                    .add_option("--bone-hu", settings.options.bone_hu,
                                "HU: what is denser is bone, where no label of any bone is there")
                    ->check(CLI::Range(-1000.0, 3000.0))
                    ->each([&settings](const std::string&) { settings.bone_given = true; })
                    ->capture_default_str());
  for (CLI::Option* option : add_image_choice(command, settings.choice)) out.push_back(option);
  out.push_back(command.add_flag("--skin-from-labels", settings.options.skin_from_labels,
                                 "draw the skin round all labels, where neither a label nor a CT shows it"));
  out.push_back(command
                    .add_option("--spine", settings.spine,
                                "bend at the joints between lumbar spine, thorax, neck and head alone, or at "
                                "each vertebra that is labelled")
                    ->check(CLI::IsMember({"whole", "vertebrae"}))
                    ->capture_default_str());
  out.push_back(
      command
          .add_option(
              "--ribs", settings.ribs,
              "with --spine vertebrae: ribs 1 to 10 as one with the sternum, or each with its vertebra")
          ->check(CLI::IsMember({"cage", "vertebrae"}))
          ->capture_default_str());
  return out;
}

NewCase new_case(const Program& program, const ScanSettings& settings, const files::ReadLimits& limits,
                 const std::filesystem::path& folder) {
  if (settings.ribs == "vertebrae" && settings.spine != "vertebrae")
    throw Error(ErrorKind::usage, "--ribs", "goes with a spine by vertebra", "add --spine vertebrae");
  ScanOptions options = settings.options;
  options.own_values = settings.skin_given && settings.bone_given;
  if (!settings.side.empty()) options.side = settings.side == "left" ? Side::left : Side::right;
  // What readers had to change belongs to what is to be looked at; of a scan that is refused it is said
  // before.
  std::vector<std::string> changed;
  const files::ReadOptions told{limits, [&](std::string_view line) { changed.emplace_back(line); }};
  Scan scan;
  NewCase out;
  try {
    scan = read_scan(settings.scan, told, settings.choice, program.context("read"));
    out.made = decide(scan, options, program.context("labels"));
  } catch (const Error&) {
    for (const std::string& line : changed) program.note("warning: " + line);
    throw;
  }
  out.made.doubts.insert(out.made.doubts.begin(), changed.begin(), changed.end());
  out.made.spine = settings.spine;
  out.made.ribs = settings.ribs;
  for (std::string& line : unread_below(settings.scan)) out.made.doubts.push_back(std::move(line));
  out.name = write_scan_case(folder, settings.scan, scan, out.made, program.context("write")).name;
  return out;
}

std::string scan_line(const ScanCase& made) {
  const auto count = [&](ScanEntry::Role role) {
    return std::count_if(made.entries.begin(), made.entries.end(),
                         [&](const ScanEntry& e) { return is_drawn(e) && e.role == role; });
  };
  return std::to_string(count(ScanEntry::Role::bone)) + " bones, " +
         std::to_string(count(ScanEntry::Role::tissue)) + " tissues, skin " + made.skin.how;
}

nlohmann::json scan_json(const ScanCase& made) {
  nlohmann::json bones = nlohmann::json::array(), tissues = bones, labels = bones;
  for (const ScanEntry& entry : made.entries) {
    if (!is_drawn(entry)) continue;
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
  return {{"bones", bones},
          {"tissues", tissues},
          {"labels", labels},
          {"skin", {{"how", made.skin.how}, {"confidence", made.skin.confidence}, {"caps", made.skin.caps}}},
          {"doubts", made.doubts},
          {"notes", made.notes}};
}

}  // namespace ecorche::app
