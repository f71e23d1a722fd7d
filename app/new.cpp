// SPDX-License-Identifier: Apache-2.0
// `ecorche new`: a scan in, a case out, with all that was decided in words.
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/scan/case_text.hpp"
#include "app/scan/new_case.hpp"
#include "app/scan/scan_page.hpp"
#include "core/files/atomic_file.hpp"
#include "core/platform/heap.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

struct NewSettings {
  ScanSettings scan;
  fs::path output, report;
  files::ReadLimits limits;
};

// Before a case stands that a second try would find in its way. Its own folder is yet to be made.
void check_report(const NewSettings& settings) {
  if (settings.report.empty()) return;
  std::error_code ignored;
  const auto place = [&](const fs::path& path) { return fs::weakly_canonical(path, ignored); };
  const fs::path within = place(settings.report).lexically_relative(place(settings.output));
  if (within.empty() || *within.begin() == "..") files::AtomicFile{settings.report};
}

int run(const Program& program, const NewSettings& settings) {
  platform::use_big_heap();
  check_case_target(settings.output, settings.scan.scan);
  check_report(settings);
  const auto [made, name] = new_case(program, settings.scan, settings.limits, settings.output);
  if (!settings.report.empty()) files::write_text(settings.report, scan_page(made, name));
  const std::string case_file = (settings.output / "case.yaml").string();
  std::string text = case_file + ": " + scan_line(made) + "\n";
  for (const std::string& doubt : made.doubts) {
    program.warn();
    text += "warning: " + doubt + "\n";
  }
  for (const std::string& note : made.notes) text += "note: " + note + "\n";
  text += "Next: " + next_commands(settings.output).preprocess;
  nlohmann::json result = scan_json(made);
  result["case"] = case_file;
  program.result(text, result);
  return 0;
}

}  // namespace

void declare_new(CLI::App& app, Program& program, Run& chosen) {
  const auto settings = std::make_shared<NewSettings>();
  CLI::App* command =
      app.add_subcommand("new", "write the case of a scan: its CT and what programs segmented in it");
  command->add_option("SCAN", settings->scan.scan, kScanHelp)->required();
  command->add_option("-o,--output", settings->output, "the folder for the case; new, or empty")->required();
  command->add_option("--report", settings->report,
                      "write a page that shows what each label became, as one HTML file");
  add_scan_options(*command, settings->scan);
  add_read_budget(*command, settings->limits);
  command->callback(
      [&program, &chosen, settings] { chosen = [&program, settings] { return run(program, *settings); }; });
}

}  // namespace ecorche::app
