// SPDX-License-Identifier: Apache-2.0
// `ecorche new`: a scan in, a case out, with all that was decided in words.
#include <filesystem>

#include "app/command.hpp"
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

int run(const Program& program, const NewSettings& settings) {
  platform::use_big_heap();
  check_case_target(settings.output, settings.scan.scan);
  const auto [made, name] = new_case(program, settings.scan, settings.limits, settings.output);
  if (!settings.report.empty()) files::write_text(settings.report, scan_page(made, name));
  const std::string case_file = (settings.output / "case.yaml").string();
  std::string text = case_file + ": " + scan_line(made) + "\n";
  for (const std::string& doubt : made.doubts) {
    program.warn();
    text += "warning: " + doubt + "\n";
  }
  for (const std::string& note : made.notes) text += "note: " + note + "\n";
  text += "Next: ecorche preprocess " + settings.output.string() + " -o " + settings.output.string() + ".hdf";
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
