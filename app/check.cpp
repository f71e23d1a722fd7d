// SPDX-License-Identifier: Apache-2.0
// `ecorche check`: reads a whole case and says what is wrong with it.
#include <fmt/format.h>

#include <filesystem>

#include "app/case_options.hpp"
#include "app/command.hpp"
#include "io/case/case_file.hpp"
#include "preprocess/check/inspect_case.hpp"
#include "preprocess/label_surfaces/label_surfaces.hpp"

namespace ecorche::app {
namespace {

using check::Finding;
using check::Report;
using check::SurfaceLine;

struct Settings {
  std::filesystem::path path;
  io::CaseOptions input;
};

nlohmann::json to_json(const Eigen::Vector3d& p) {
  return {p.x(), p.y(), p.z()};
}

nlohmann::json to_json(const check::Offenders& offenders) {
  nlohmann::json out{{"count", offenders.count}};
  if (offenders.first) out["first"] = to_json(*offenders.first);
  return out;
}

nlohmann::json to_json(const SurfaceLine& line) {
  const check::SurfaceFigures& f = line.figures;
  nlohmann::json out{{"name", line.name},
                     {"group", group_name(line.group)},
                     {"vertices", f.vertices},
                     {"triangles", f.triangles},
                     {"open_edges", to_json(f.open)},
                     {"nonmanifold_edges", to_json(f.nonmanifold)},
                     {"flipped_edges", to_json(f.flipped)},
                     {"flipped_triangles", to_json(f.turned)},
                     {"duplicate_triangles", to_json(f.duplicate)},
                     {"degenerate_triangles", to_json(f.degenerate)},
                     {"components", f.components},
                     {"specks", line.specks},
                     {"inner", line.inner},
                     {"volume_mm3", f.volume_mm3},
                     {"low", to_json(f.low)},
                     {"high", to_json(f.high)}};
  out["holes"] = nlohmann::json::array();
  for (const check::Hole& hole : f.holes)
    out["holes"].push_back(
        {{"edges", hole.edges}, {"length_mm", hole.length_mm}, {"at", to_json(hole.middle)}});
  // null: a build without GPL parts does not look.
  out["self_intersections"] = line.intersections ? to_json(*line.intersections) : nlohmann::json();
  if (line.outside) {
    out["outside_skin"] = {{"vertices", line.outside->count},
                           {"share", line.outside->share},
                           {"largest_mm", line.outside->largest_mm},
                           {"farthest", to_json(line.outside->farthest)}};
  }
  return out;
}

nlohmann::json to_json(const Finding& finding) {
  nlohmann::json out{{"severity", check::severity_name(finding.severity)},
                     {"where", finding.where},
                     {"what", finding.what},
                     {"mend", finding.mend}};
  out["at"] = finding.at ? to_json(*finding.at) : nlohmann::json();
  return out;
}

std::string text_report(const Report& report) {
  std::string out =
      fmt::format("{:<24} {:<9} {:>8} {:>9} {:>6} {:>6} {:>7} {:>6} {:>5} {:>10}\n", "surface", "group",
                  "vertices", "triangles", "open", "n-man.", "flipped", "degen.", "parts", "ml");
  for (const SurfaceLine& line : report.surfaces) {
    const check::SurfaceFigures& f = line.figures;
    out += fmt::format("{:<24} {:<9} {:>8} {:>9} {:>6} {:>6} {:>7} {:>6} {:>5} {:>10.1f}\n", line.name,
                       group_name(line.group), f.vertices, f.triangles, f.open.count, f.nonmanifold.count,
                       f.flipped.count, f.degenerate.count, f.components, f.volume_mm3 / 1000);
  }
  out += '\n';
  for (const Finding& finding : report.findings) {
    out += fmt::format("{}: {}: {}", check::severity_name(finding.severity), finding.where, finding.what);
    if (finding.at)
      out += fmt::format(", at [{:.2f}, {:.2f}, {:.2f}]", finding.at->x(), finding.at->y(), finding.at->z());
    out += fmt::format(" ({})\n", finding.mend);
  }
  if (report.findings.empty()) out += "nothing found\n";
  if (!report.surfaces.empty() && !report.surfaces.front().intersections)
    out += "this build does not look for self-intersections\n";
  if (!report.possible()) out += "this case cannot be preprocessed\n";
  return out;
}

int run(const Program& program, const Settings& settings) {
  Case patient = io::read_case(settings.path, settings.input, program.context("read"));
  label_surfaces::resolve(patient, program.context("surfaces"));
  const Report report = check::inspect(patient, program.context("check"));
  nlohmann::json object{{"ok", report.possible()}, {"name", patient.name}};
  object["surfaces"] = nlohmann::json::array();
  object["findings"] = nlohmann::json::array();
  for (const SurfaceLine& line : report.surfaces) object["surfaces"].push_back(to_json(line));
  for (const Finding& finding : report.findings) object["findings"].push_back(to_json(finding));
  program.result(text_report(report), object);
  return report.possible() ? 0 : exit_code(ErrorKind::data);
}

}  // namespace

void declare_check(CLI::App& app, Program& program, Run& chosen) {
  const auto settings = std::make_shared<Settings>();
  CLI::App* command =
      app.add_subcommand("check", "read a whole case and say what is wrong with it; changes nothing");
  command->add_option("CASE", settings->path, "a case.yaml, or the folder that holds one")->required();
  add_case_options(*command, settings->input);
  command->callback(
      [&program, &chosen, settings] { chosen = [&program, settings] { return run(program, *settings); }; });
}

}  // namespace ecorche::app
