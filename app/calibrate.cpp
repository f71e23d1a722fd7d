// SPDX-License-Identifier: Apache-2.0
// ecorche calibrate MODEL: joints sampled by finite elements, and what skinning misses kept in the model.
#include <fmt/format.h>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include <ecorche/model_file/model_file.hpp>
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/correction_report.hpp"
#include "app/safe_range.hpp"
#include "app/stage_folder.hpp"
#include "app/whole_poses.hpp"
#include "core/files/atomic_file.hpp"
#include "preprocess/correct/calibrate.hpp"
#include "preprocess/correct/transfer.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kCacheGib = 1000;  // samples are never worth less than the time they took

struct CalibrateSettings {
  fs::path model, output, cache, from;
  correct::CalibrateOptions options;
  std::vector<std::string> poses;
  bool whole_poses = true, ranges = true;
};

json report_of(const correct::JointReport& joint) {
  json tried = json::array();
  for (const correct::SampleReport& sample : joint.tried) {
    const Eigen::Vector3d turn = sample.from_rest * 180 / std::numbers::pi;
    tried.push_back({{"from_rest_deg", {turn[0], turn[1], turn[2]}},
                     {"clean", sample.clean},
                     {"inverted", sample.inverted},
                     {"inverted_skinned", sample.by_skinning},
                     {"iterations", sample.iterations}});
  }
  return {{"joint", joint.joint},     {"tets", joint.tets},     {"free_nodes", joint.free_nodes},
          {"samples", joint.samples}, {"clean", joint.clean},   {"clean_deg", joint.clean_deg},
          {"nodes", joint.nodes},     {"modes", joint.modes},   {"bytes", joint.bytes},
          {"mean_mm", joint.mean_mm}, {"max_mm", joint.max_mm}, {"tried", tried}};
}

std::string text_of(const json& report, const Model& model) {
  std::string out = "joint, tets, samples clean of asked, to (deg), nodes, modes, KiB, at most (mm)\n";
  for (const json& row : report["joints"])
    out +=
        fmt::format("  {:<24} {:>8} {:>3} of {:<3} {:>5.0f} {:>8} {:>3} {:>8.0f} {:>6.1f}\n",
                    row["joint"].get<std::string>(), row["tets"].get<int>(), row["clean"].get<int>(),
                    row["samples"].get<int>(), row["clean_deg"].get<double>(), row["nodes"].get<int>(),
                    row["modes"].get<int>(), row["bytes"].get<double>() / 1024, row["max_mm"].get<double>());
  out += settled_poses_text(report["poses"]);
  out += correction_text(json::array(), safe_ranges_json(model));
  return out + fmt::format(
                   "\nsolved in {:.0f} s, poses in {:.0f} s, ranges in {:.0f} s. Nearer to finite elements, "
                   "never nearer to the "
                   "patient.\n"
                   "For training and education, not for planning surgery.",
                   report["seconds"]["samples"].get<double>(), report["seconds"]["poses"].get<double>(),
                   report["seconds"]["ranges"].get<double>());
}

// Joints without a clean sample keep skinning as it is, which must be said.
void warn_of(const Program& program, const correct::Calibration& found) {
  for (const correct::JointReport& joint : found.joints) {
    if (joint.tets > 0 && joint.clean == 0)
      program.note("warning: " + joint.joint +
                   ": no sample by finite elements came out clean, so it stays as skinned (prepare the model "
                   "with more tets)");
  }
}

struct Made {
  correct::Calibration calibration;
  std::string how;
};

Made make(const Program& program, const CalibrateSettings& s, const Model& model,
          preprocess::StageStore* store) {
  if (s.from.empty())
    return {
        correct::calibrate(model, s.options, store, program.context("finite elements")),
        fmt::format("p1 stable_neo_hookean, Poisson's ratio {:g}, step {:g} deg, from {:g} mm, folds {:g}",
                    s.options.poisson, s.options.step_deg, s.options.least_mm, s.options.folds) +
            (model.materials.empty() ? ""
                                     : fmt::format(", {} Young's moduli", model.materials.tissue.size()))};
  const Model coarse = model_file::read(s.from, program.context("reading"));
  const auto how = coarse.provenance.find("correction");
  return {
      correct::transfer(coarse, model, s.options.joints, s.options.least_mm, program.context("taking over")),
      fmt::format("{}, of {} tets", how == coarse.provenance.end() ? "unknown" : how->second,
                  coarse.tet_count())};
}

int run(const Program& program, const CalibrateSettings& s) {
  using Clock = std::chrono::steady_clock;
  { const files::AtomicFile probe(s.output); }  // refused now, not after the hours that solving takes
  const auto model = std::make_shared<Model>(model_file::read(s.model, program.context("reading")));
  model->corrections.clear();
  model->pose_corrections.clear();
  model->safe_ranges.clear();
  // Who asks for some joints has no use for whole bodies, unless they are named.
  std::vector<correct::WholePose> whole;
  if (s.whole_poses && (s.options.joints.empty() || !s.poses.empty()))
    whole = whole_poses(program, s.poses, model->rig);
  std::optional<StageFolder> store;
  if (!s.cache.empty()) store.emplace(s.cache, kCacheGib);
  const auto began = Clock::now();
  Made made = make(program, s, *model, store ? &*store : nullptr);
  correct::Calibration& found = made.calibration;
  warn_of(program, found);
  model->corrections = std::move(found.corrections);
  const auto solved = Clock::now();
  const json poses = add_whole_poses(program, whole, model, store ? &*store : nullptr);
  const auto settled = Clock::now();
  std::vector<std::size_t> rows;
  for (const std::string& joint : s.options.joints)
    rows.push_back(static_cast<std::size_t>(model->rig.skeleton.find_joint(joint)));
  if (s.ranges)
    model->safe_ranges =
        measure_safe_ranges(model, rows, store ? &*store : nullptr, program.context("safe ranges"));
  const auto measured = Clock::now();
  model->provenance["correction"] = made.how;
  model_file::write(*model, s.output, program.context("writing"));
  const auto seconds = [](auto from, auto to) { return std::chrono::duration<double>(to - from).count(); };
  json report{{"ok", true},
              {"output", s.output.string()},
              {"joints", json::array()},
              {"safe_ranges", safe_ranges_json(*model)},
              {"poses", poses},
              {"seconds",
               {{"samples", seconds(began, solved)},
                {"poses", seconds(solved, settled)},
                {"ranges", seconds(settled, measured)}}},
              {"purpose", "training and education, not planning of surgery"}};
  for (const correct::JointReport& joint : found.joints) report["joints"].push_back(report_of(joint));
  program.result(text_of(report, *model), report);
  return 0;
}

}  // namespace

void declare_calibrate(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<CalibrateSettings>();
  CLI::App* command = app.add_subcommand(
      "calibrate", "move skinning towards finite elements: joints sampled, the difference kept in the model");
  command->add_option("MODEL", s->model, "a model that preprocess made")->required();
  command->add_option("-o,--output", s->output, "the model with its correction, ending in .hdf")->required();
  command
      ->add_option("--joints", s->options.joints,
                   "joints to sample, with commas between; without it all that turn by themselves")
      ->delimiter(',');
  command
      ->add_option("--poses", s->poses,
                   "whole poses to settle and keep, with commas between: pose files, or lib:NAME; without "
                   "it all of the library, where no --joints are named")
      ->delimiter(',');
  command->add_flag("!--no-poses", s->whole_poses, "keep no whole poses")->excludes("--poses");
  command->add_option("--step", s->options.step_deg, "degrees between samples of a hinge, at most")
      ->check(CLI::Range(2.0, 60.0))
      ->capture_default_str();
  command
      ->add_option("--least", s->options.least_mm,
                   "mm: where every sample moves a node less, nothing is kept of it")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  command
      ->add_option(
          "--folds", s->options.folds,
          "how many tets a sample may leave inside out, as a share of those that skinning leaves so; "
          "0: none, and the correction ends where the first tet folds")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--cache", s->cache,
                      "a folder that keeps each solved sample: resumes an interrupted run");
  command
      ->add_option(
          "--from", s->from,
          "a calibrated model of the same case with fewer tets: its correction is taken over, nothing "
          "is solved")
      ->excludes("--step", "--folds");
  command->add_flag("!--no-ranges", s->ranges, "leave out how far each joint may be turned");
  command->footer(
      "Skinning about centres of rotation is corrected, lbs and dqs are not.\n"
      "Nearer to finite elements, never nearer to the patient: all flesh equally stiff unless the case "
      "gives stiffness_kpa, glued to the bones, no gravity.");
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run(program, *s); }; });
}

}  // namespace ecorche::app
