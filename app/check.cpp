// SPDX-License-Identifier: Apache-2.0
// `ecorche check`: reads a whole case and says what is wrong with it.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include <ecorche/io/case_file.hpp>
#include "app/case_options.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/drawn_surfaces.hpp"
#include "preprocess/check/inspect_case.hpp"
#include "preprocess/check/joints.hpp"
#include "preprocess/label_surfaces/label_surfaces.hpp"
#include "preprocess/look_ahead.hpp"

namespace ecorche::app {
namespace {

using check::Finding;
using check::Report;
using check::SurfaceLine;

struct CheckSettings {
  std::filesystem::path path;
  io::CaseOptions input;
  bool all = false;  // a line for every surface
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
    out["holes"].push_back({{"edges", hole.edges},
                            {"length_mm", hole.length_mm},
                            {"filling_edge_mm", hole.filling_edge},
                            {"at", to_json(hole.middle)}});
  // null: a build without GPL parts does not look, nor anybody at what we drew ourselves.
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

// Across, front to back, and tall: of the skin.
Eigen::Vector3d body_size(const Report& report) {
  return report.surfaces.empty()
             ? Eigen::Vector3d::Zero()
             : Eigen::Vector3d(report.surfaces.front().figures.high - report.surfaces.front().figures.low);
}

bool has_defect(const SurfaceLine& line) {
  const check::SurfaceFigures& f = line.figures;
  return f.open.count + f.nonmanifold.count + f.flipped.count + f.degenerate.count > 0;
}

// What the case holds, in a line.
std::string summary(const Report& report) {
  std::map<std::string, int> groups;
  std::int64_t triangles = 0;
  for (const SurfaceLine& line : report.surfaces) {
    ++groups[std::string(group_name(line.group))];
    triangles += static_cast<std::int64_t>(line.figures.triangles);
  }
  std::string out = fmt::format("{} surfaces", report.surfaces.size());
  for (const auto& [group, count] : groups) out += fmt::format(", {} {}", count, group);
  return out + fmt::format("; {} triangles\n", triangles);
}

std::string text_report(const Report& report, bool all) {
  std::string out = summary(report);
  const auto shown = [&](const SurfaceLine& line) { return all || has_defect(line); };
  if (std::any_of(report.surfaces.begin(), report.surfaces.end(), shown))
    out += fmt::format("{:<24} {:<9} {:>8} {:>9} {:>6} {:>6} {:>7} {:>6} {:>5} {:>10}\n", "surface", "group",
                       "vertices", "triangles", "open", "n-man.", "flipped", "degen.", "parts", "ml");
  for (const SurfaceLine& line : report.surfaces) {
    if (!shown(line)) continue;
    const check::SurfaceFigures& f = line.figures;
    out += fmt::format("{:<24} {:<9} {:>8} {:>9} {:>6} {:>6} {:>7} {:>6} {:>5} {:>10.4g}\n", line.name,
                       group_name(line.group), f.vertices, f.triangles, f.open.count, f.nonmanifold.count,
                       f.flipped.count, f.degenerate.count, f.components, f.volume_mm3 / 1000);
  }
  const Eigen::Vector3d size = body_size(report);
  out += fmt::format("\nthe body is {:.4g} x {:.4g} x {:.4g} mm\n", size.x(), size.y(), size.z());
  for (const Finding& finding : report.findings) {
    out += fmt::format("{}: {}: {}", check::severity_name(finding.severity), finding.where, finding.what);
    if (finding.at)
      out += fmt::format(", at [{:.2f}, {:.2f}, {:.2f}]", finding.at->x(), finding.at->y(), finding.at->z());
    out += fmt::format(" ({})\n", finding.mend);
  }
  if (report.findings.empty()) out += "nothing found\n";
  if (std::any_of(report.surfaces.begin(), report.surfaces.end(),
                  [](const SurfaceLine& line) { return !line.intersections && !line.drawn; }))
    out += "this build does not look for self-intersections\n";
  if (!report.possible()) out += "this case cannot be preprocessed\n";
  return out;
}

int run(const Program& program, const CheckSettings& settings) {
  Case patient = io::read_case(settings.path, settings.input, program.context("read"));
  const std::set<std::string> drawn = drawn_surfaces(patient);
  label_surfaces::resolve(patient, program.context("surfaces"));
  Report report = check::inspect(patient, program.context("check"), {drawn});
  check::inspect_joints(patient, program.context("joints"), report);
  if (report.possible()) {
    for (Finding& finding : preprocess::look_ahead(patient, program.context("preparing")))
      report.findings.push_back(std::move(finding));
  }
  nlohmann::json object{{"ok", report.possible()}, {"name", patient.name}};
  object["body_mm"] = to_json(body_size(report));
  object["surfaces"] = nlohmann::json::array();
  object["findings"] = nlohmann::json::array();
  for (const SurfaceLine& line : report.surfaces) object["surfaces"].push_back(to_json(line));
  for (const Finding& finding : report.findings) object["findings"].push_back(to_json(finding));
  if (std::any_of(report.findings.begin(), report.findings.end(),
                  [](const Finding& finding) { return finding.severity == check::Severity::warning; }))
    program.warn();
  program.result(text_report(report, settings.all), object);
  return report.possible() ? 0 : exit_code(ErrorKind::data);
}

}  // namespace

void declare_check(CLI::App& app, Program& program, Run& chosen) {
  const auto settings = std::make_shared<CheckSettings>();
  CLI::App* command =
      app.add_subcommand("check", "read a whole case and say what is wrong with it; changes nothing");
  command->add_option("CASE", settings->path, "a case.yaml, or the folder that holds one")->required();
  command->add_flag("--all", settings->all, "list every surface, not only those with defects");
  add_case_options(*command, settings->input);
  command->callback(
      [&program, &chosen, settings] { chosen = [&program, settings] { return run(program, *settings); }; });
}

}  // namespace ecorche::app
