// SPDX-License-Identifier: Apache-2.0
#include "app/prepare_model.hpp"

#include <algorithm>
#include <chrono>
#include <optional>

#include <ecorche/model_file/model_file.hpp>
#include "app/drawn_surfaces.hpp"
#include "app/stage_folder.hpp"
#include "io/surface/surface_file.hpp"
#include "preprocess/check/image_places.hpp"
#include "preprocess/check/inspect_case.hpp"
#include "preprocess/label_surfaces/label_surfaces.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using preprocess::StageTime;

// Runs one step that is not the pipeline's, and times it alike.
template <class F>
void timed(std::vector<StageTime>& stages, const std::string& name, F&& step) {
  const auto start = std::chrono::steady_clock::now();
  step();
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  stages.push_back({name, spent.count(), preprocess::peak_rss_mib(), false});
}

// As `ecorche check` looks: warnings are passed on, notes left out; a case that cannot be prepared is
// refused.
void inspect(const Case& patient, const std::set<std::string>& drawn, const Context& context) {
  const check::Report report = check::inspect(patient, context, {drawn});
  for (const check::Finding& finding : report.findings) {
    if (finding.severity == check::Severity::error)
      throw Error(ErrorKind::data, finding.where, finding.what, finding.mend);
    if (finding.severity == check::Severity::warning)
      context.warn(finding.where + ": " + finding.what + " (" + finding.mend + ")");
  }
}

// `context`, whose warnings are also put behind `warnings`.
Context noting(Context context, std::vector<std::string>& warnings) {
  context.log = [&warnings, said = std::move(context.log)](LogLevel level, std::string_view line) {
    if (level == LogLevel::warning) warnings.emplace_back(line);
    if (said) said(level, line);
  };
  return context;
}

// The worst tets instead of the model that is not written, for ParaView.
std::string write_refused(const fs::path& path, const preprocess::WorstTets& worst) {
  const std::vector<float> label(worst.label.begin(), worst.label.end());
  const std::vector<float> row(worst.tet.begin(), worst.tet.end());
  io::write_tets(path, worst.V, worst.T, {},
                 {{"label", 1, label},
                  {"tet", 1, row},
                  {"least_dihedral_deg", 1, worst.least_deg},
                  {"greatest_dihedral_deg", 1, worst.greatest_deg},
                  {"volume_mm3", 1, worst.volume_mm3}});
  return "its " + std::to_string(worst.tet.size()) + " worst tets are in " + path.string();
}

}  // namespace

PreparedModel prepare_model(const Program& program, const PrepareSettings& settings) {
  std::optional<StageFolder> kept;
  if (!settings.cache.empty()) kept.emplace(settings.cache, settings.cache_gib);
  PreparedModel out;
  std::vector<StageTime>& stages = out.stages;
  std::vector<std::string>& warnings = out.warnings;
  Case patient;
  timed(stages, "read", [&] {
    patient = io::read_case(settings.case_path, settings.input, noting(program.context("read"), warnings));
  });
  const std::set<std::string> drawn = drawn_surfaces(patient);
  timed(stages, "surfaces",
        [&] { label_surfaces::resolve(patient, noting(program.context("surfaces"), warnings)); });

  if (settings.check) {
    timed(stages, "check", [&] { inspect(patient, drawn, noting(program.context("check"), warnings)); });
  } else {
    const Context context = noting(program.context("check"), warnings);
    for (const check::Misplaced& image : check::misplaced_images(patient))
      context.warn(image.name + ": " + image.what + " (" + image.mend + ")");
  }

  // The pipeline has one context for all stages; each stage has a bar of its own.
  Context bar = program.context("preprocess");
  Context context = bar.quiet();
  context.progress = [&](double fraction) { bar.report(fraction); };
  context.log = [&](LogLevel level, std::string_view line) { bar.log(level, line); };
  preprocess::Hooks hooks;
  hooks.on_stage = [&](std::string_view name, int index, int count) {
    bar = program.context(std::to_string(index + 1) + "/" + std::to_string(count) + " " + std::string(name));
  };
  hooks.store = kept ? &*kept : nullptr;
  hooks.on_refusal = [&](const preprocess::WorstTets& worst) {
    return write_refused(settings.refused, worst);
  };
  hooks.on_rig = settings.on_rig;
  preprocess::Result made = preprocess::run(patient, settings.options, context, hooks);
  stages.insert(stages.end(), made.stages.begin(), made.stages.end());
  timed(stages, "write", [&] { model_file::write(made.model, settings.output, program.context("write")); });

  std::vector<model_file::DigestCheck> digests;  // of what is on the disk now
  // The model stands under its name by now: a stop would leave it there and call it interrupted.
  Context verifying = program.context("verify");
  verifying.stop = {};
  timed(stages, "verify", [&] { digests = model_file::check_digests(settings.output, verifying); });
  const auto bad = static_cast<std::size_t>(std::count_if(
      digests.begin(), digests.end(), [](const model_file::DigestCheck& d) { return !d.good; }));
  if (bad > 0) {
    throw Error(ErrorKind::io, settings.output.string(),
                std::to_string(bad) + " datasets came back changed from the disk", "check the disk");
  }
  out.digests = digests.size();
  warnings.insert(warnings.end(), made.warnings.begin(), made.warnings.end());
  out.model = std::move(made.model);
  return out;
}

}  // namespace ecorche::app
