// SPDX-License-Identifier: Apache-2.0
// `ecorche rig CASE`: the joints of a case, found in seconds, before anything else is prepared.
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include <ecorche/io/case_file.hpp>
#include "app/case_options.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/joint_json.hpp"
#include "core/files/atomic_file.hpp"
#include "core/kinematics/posed_rest.hpp"
#include "io/surface/surface_file.hpp"
#include "preprocess/check/joints.hpp"
#include "preprocess/label_surfaces/label_surfaces.hpp"
#include "preprocess/rig/bone_points.hpp"
#include "preprocess/rig/fit_rig.hpp"

namespace ecorche::app {
namespace {

struct RigSettings {
  std::filesystem::path case_path, output, bones, evidence;
  io::CaseOptions input;
};

std::string rig_text(const nlohmann::json& rig) {
  std::string out =
      "joint, rule, centre (mm LPS), residual (mm), inliers (%), vertices, confidence; rest angles (deg)\n";
  for (const nlohmann::json& row : rig) {
    const nlohmann::json &c = row["center_mm"], &fit = row["fit"];
    char line[256];
    std::snprintf(line, sizeof line, "  %-24s %-12s %8.1f %8.1f %8.1f %7.2f %5.0f %7d %5.2f ",
                  row["joint"].get<std::string>().c_str(), fit["rule"].get<std::string>().c_str(),
                  c[0].get<double>(), c[1].get<double>(), c[2].get<double>(),
                  fit["residual_mm"].get<double>(), 100 * fit["inlier_share"].get<double>(),
                  fit["points"].get<int>(), fit["confidence"].get<double>());
    out += line;
    for (const nlohmann::json& angle : row["angles"]) {
      std::snprintf(line, sizeof line, " %s %.1f", angle["name"].get<std::string>().c_str(),
                    angle["rest_deg"].get<double>());
      out += line;
    }
    out += "\n";
  }
  for (const nlohmann::json& row : rig) {
    for (const nlohmann::json& by : row["coupled"]) {
      char line[256];
      std::snprintf(line, sizeof line, "  %s %s follows %s %s x %g\n",
                    row["joint"].get<std::string>().c_str(), by["drives"].get<std::string>().c_str(),
                    by["joint"].get<std::string>().c_str(), by["angle"].get<std::string>().c_str(),
                    by["ratio"].get<double>());
      out += line;
    }
  }
  return out + "For training and education, not for planning surgery.";
}

// Each segment's bones as one surface, LPS mm.
void write_bones(const std::filesystem::path& folder, const Case& patient, const Skeleton& skeleton) {
  files::make_folder(folder);
  rig::BonePoints bones(patient);
  for (const Segment& segment : skeleton.segments) {
    const SurfaceMesh& surface = bones.segment(segment.name);
    if (surface.F.rows() > 0) io::write_surface(folder / (segment.name + ".stl"), surface);
  }
}

// What each joint was found on: for pictures of it.
void write_evidence(const std::filesystem::path& file, const Rig& rig,
                    const std::vector<rig::JointEvidence>& evidence) {
  const auto numbers = [](const Eigen::Vector3d& v) { return nlohmann::json::array({v.x(), v.y(), v.z()}); };
  nlohmann::json joints = nlohmann::json::object();
  for (std::size_t row = 0; row < evidence.size(); ++row) {
    nlohmann::json vertices = nlohmann::json::array();
    for (const Eigen::Vector3d& v : evidence[row].vertices) vertices.push_back(numbers(v));
    joints[rig.skeleton.segments[row].joint.name] = {{"rule", center_rule_name(evidence[row].rule)},
                                                     {"center_mm", numbers(evidence[row].at)},
                                                     {"axis", numbers(evidence[row].axis)},
                                                     {"radius_mm", evidence[row].radius},
                                                     {"vertices_mm", vertices}};
  }
  files::write_text(file, joints.dump());
}

// A warning's line, taken apart: `joint NAME: what (how to mend)`, `segment NAME what: ... (how to mend)`.
check::Finding finding_of(std::string_view line) {
  check::Finding out{check::Severity::warning, "", "", {}, ""};
  const std::string advice = " (" + std::string(rig::joint_advice) + ")";
  if (line.ends_with(advice)) {
    out.mend = rig::joint_advice;
    line.remove_suffix(advice.size());
  } else if (const std::size_t open = line.rfind(" ("); line.ends_with(")") && open != line.npos) {
    out.mend = line.substr(open + 2, line.size() - open - 3);
    line = line.substr(0, open);
  }
  const bool segment = line.starts_with("segment ");
  const std::size_t end = segment ? line.find(' ', std::string_view("segment ").size()) : line.find(": ");
  out.where = line.substr(0, end);
  out.what = end == line.npos ? line : line.substr(end + (segment ? 1 : 2));
  return out;
}

// A stage's context whose warnings are kept as findings, too: JSON tells all that stderr does.
Context keeping(const Program& program, std::string label, std::vector<check::Finding>& kept) {
  Context context = program.context(std::move(label));
  context.log = [log = context.log, &kept](LogLevel level, std::string_view line) {
    if (level == LogLevel::warning) kept.push_back(finding_of(line));
    log(level, line);
  };
  return context;
}

nlohmann::json finding_json(const check::Finding& f) {
  return {
      {"severity", check::severity_name(f.severity)}, {"where", f.where}, {"what", f.what}, {"mend", f.mend}};
}

int run(const Program& program, const RigSettings& settings) {
  std::vector<check::Finding> warned;
  Case patient = io::read_case(settings.case_path, settings.input, keeping(program, "read", warned));
  label_surfaces::resolve(patient, keeping(program, "surfaces", warned));
  std::vector<rig::JointEvidence> evidence;
  const Rig rig = rig::fit(patient, keeping(program, "rig", warned), &evidence);
  if (!settings.evidence.empty()) write_evidence(settings.evidence, rig, evidence);
  if (!settings.bones.empty()) write_bones(settings.bones, patient, rig.skeleton);
  if (!settings.output.empty()) {
    // The rig as it stands is its own rest: every centre, axis and angle given.
    const Skeleton given = kinematics::posed_rest(rig, Pose::rest(rig.skeleton.segments.size()));
    files::write_text(settings.output, io::skeleton_to_yaml(given));
  }
  nlohmann::json joints = nlohmann::json::array();
  for (std::size_t row = 0; row < rig.skeleton.segments.size(); ++row) {
    joints.push_back(joint_json(rig, row));
    joints.back()["fit"]["center_confidence"] = evidence[row].center_confidence;
    joints.back()["fit"]["axes_confidence"] = evidence[row].axes_confidence;
  }
  std::vector<check::Finding> findings = check::size_findings(patient);
  for (check::Finding& finding :
       check::joint_findings(patient, rig, check::Inside(patient.skin), keeping(program, "joints", warned)))
    findings.push_back(std::move(finding));
  nlohmann::json told = nlohmann::json::array();
  for (const check::Finding& f : warned) told.push_back(finding_json(f));
  std::string text;
  bool possible = true;
  for (const check::Finding& f : findings) {
    told.push_back(finding_json(f));
    possible = possible && f.severity != check::Severity::error;
    if (f.severity == check::Severity::warning) program.warn();
    text += std::string(check::severity_name(f.severity)) + ": " + f.where + ": " + f.what + " (" + f.mend +
            ")\n";
  }
  program.result(text + rig_text(joints),
                 {{"ok", possible}, {"skeleton", rig.skeleton.name}, {"rig", joints}, {"findings", told}});
  return possible ? 0 : exit_code(ErrorKind::data);
}

}  // namespace

void declare_rig(CLI::App& app, Program& program, Run& chosen) {
  const auto settings = std::make_shared<RigSettings>();
  CLI::App* command = app.add_subcommand("rig", "find the joints of a case, and say how well each was found");
  command->add_option("CASE", settings->case_path, "a case.yaml, or the folder that holds one")->required();
  command->add_option("-o,--output", settings->output,
                      "write the skeleton with every centre, axis and rest angle");
  command->add_option("--bones", settings->bones, "write each segment's bones as one STL into this folder");
  command->add_option("--evidence", settings->evidence,
                      "write the vertices, spheres and cylinders that joints were found on, as JSON");
  add_case_options(*command, settings->input);
  command->callback(
      [&program, &chosen, settings] { chosen = [&program, settings] { return run(program, *settings); }; });
}

}  // namespace ecorche::app
