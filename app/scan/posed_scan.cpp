// SPDX-License-Identifier: Apache-2.0
#include "app/scan/posed_scan.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/cli.hpp"
#include "app/prepare_model.hpp"
#include "core/files/scratch_folder.hpp"
#include "core/platform/heap.hpp"
#include "core/values/text.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "patient";  // of the case, and so of the model
constexpr double kSure = 0.9;             // names that are known have more, sides that are not clear less
constexpr std::size_t kMostNamed = 3;

// The bones that are least sure, in one line; empty where all are.
std::string least_sure(const ScanCase& made) {
  std::vector<const ScanEntry*> unsure;
  for (const ScanEntry& entry : made.entries) {
    if (entry.role == ScanEntry::Role::bone && entry.drawn && entry.voxels > 0 && entry.confidence < kSure)
      unsure.push_back(&entry);
  }
  std::stable_sort(unsure.begin(), unsure.end(),
                   [](const ScanEntry* a, const ScanEntry* b) { return a->confidence < b->confidence; });
  std::string out;
  for (std::size_t i = 0; i < std::min(unsure.size(), kMostNamed); ++i)
    out += (i == 0 ? "" : "; ") + unsure[i]->name + " " + text::number(unsure[i]->confidence, 2) + " (" +
           unsure[i]->how + ")";
  if (unsure.size() > kMostNamed) out += "; and " + std::to_string(unsure.size() - kMostNamed) + " more";
  return out;
}

void tell(const Program& program, const ScanCase& made) {
  program.note("scan: " + scan_line(made));
  if (const std::string unsure = least_sure(made); !unsure.empty()) program.note("least sure: " + unsure);
  for (const std::string& doubt : made.doubts) program.note("warning: " + doubt);
  const std::size_t notes = made.notes.size();
  if (notes > 0)
    program.note(std::to_string(notes) + (notes == 1 ? " note" : " notes") +
                 " on the scan, and what became of each label: ecorche new, with --report");
}

// What does not exist any more is named as `ecorche new -o patient` would.
Error outside(const Error& error, const fs::path& scratch) {
  const std::string hidden = scratch.string() + "/";
  std::string where = error.where();
  const std::size_t at = where.find(hidden);
  if (at == where.npos) return error;
  where.erase(at, hidden.size());
  return {
      error.kind(), where, error.problem(),
      error.mend() + "; ecorche new SCAN... -o " + kName + " writes that case, to be looked at and mended"};
}

}  // namespace

void add_scan_posing(CLI::App& command, ScanPosing& posing) {
  CLI::Option* scan = command.add_option(
      "--scan", posing.scan.scan,
      std::string("instead of a model: a scan, posed as it is by new, preprocess and pose, with no file "
                  "between; ") +
          kScanHelp);
  for (CLI::Option* option : add_scan_options(command, posing.scan)) option->needs(scan);
  for (CLI::Option* option : add_mesh_options(command, posing.prepare)) option->needs(scan);
}

int pose_scan(const Program& program, const ScanPosing& posing, const ScanRun& run) {
  platform::use_big_heap();
  const files::ScratchFolder scratch(run.output);
  try {
    PrepareSettings prepare;
    prepare.case_path = scratch.path() / kName;
    prepare.output = scratch.path() / (std::string(kName) + ".hdf");
    prepare.refused = run.output.string() + ".refused.vtu";
    prepare.input.limits = run.limits;
    prepare.options = posing.prepare;
    prepare.on_rig = run.on_rig;
    nlohmann::json said;
    {
      const NewCase made = new_case(program, posing.scan, run.limits, prepare.case_path);
      tell(program, made.made);
      said = scan_json(made.made);
    }
    prepare_model(program, prepare);
    return run.pose(prepare.output, said);
  } catch (const Error& error) {
    throw outside(error, scratch.path());
  }
}

}  // namespace ecorche::app
