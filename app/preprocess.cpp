// SPDX-License-Identifier: Apache-2.0
// `ecorche preprocess`: a case in, a model out.
#include <ecorche/preprocess/pipeline.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <sstream>

#include <ecorche/io/case_file.hpp>
#include <ecorche/model_file/model_file.hpp>
#include "app/case_options.hpp"
#include "app/command.hpp"
#include "app/drawn_surfaces.hpp"
#include "app/model_report.hpp"
#include "app/report/page.hpp"
#include "app/stage_folder.hpp"
#include "core/files/atomic_file.hpp"
#include "core/files/stale_parts.hpp"
#include "core/platform/heap.hpp"
#include "core/values/text.hpp"
#include "io/surface/surface_file.hpp"
#include "preprocess/check/image_places.hpp"
#include "preprocess/check/inspect_case.hpp"
#include "preprocess/label_surfaces/label_surfaces.hpp"
#include "preprocess/tet/mesher.hpp"
#include "preprocess/thin/thinning.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using preprocess::StageTime;

struct PreprocessSettings {
  fs::path case_path, output;
  io::CaseOptions input;
  preprocess::Options options;
  fs::path cache;  // empty: nothing is kept
  double cache_gib = 8;
  fs::path report;  // empty: none
  bool check = false;
};

// Runs one step that is not the pipeline's, and times it alike.
template <class F>
void timed(std::vector<StageTime>& stages, const std::string& name, F&& step) {
  const auto start = std::chrono::steady_clock::now();
  step();
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  stages.push_back({name, spent.count(), preprocess::peak_rss_mib(), false});
}

std::string stage_table(const std::vector<StageTime>& stages) {
  std::string out = "stage           seconds   peak MiB\n";
  char line[80];
  double seconds = 0, peak = 0;
  for (const StageTime& s : stages) {
    std::snprintf(line, sizeof line, "%-12s %10.2f %10.0f%s\n", s.name.c_str(), s.seconds, s.peak_rss_mib,
                  s.kept ? "  kept" : "");
    out += line;
    seconds += s.seconds;
    peak = std::max(peak, s.peak_rss_mib);
  }
  std::snprintf(line, sizeof line, "%-12s %10.2f %10.0f\n", "all", seconds, peak);
  return out + line;
}

std::string spheres_line(const Model& model) {
  std::ostringstream out;
  for (const VolumetricSkeleton& s : model.spheres)
    out << "spheres of '" << s.name << "': " << s.size() << " at TP " << s.thinness << "\n";
  return out.str();
}

std::string text_report(const Model& model, const PreprocessSettings& settings,
                        const std::vector<StageTime>& stages) {
  const Certificate& c = model.certificate;
  std::ostringstream out;
  out << settings.output.string() << ": " << model.tet_count() << " tets, " << model.node_count()
      << " nodes, " << model.segment_count() << " segments, " << c.tissue_vertices << " tissue vertices\n\n"
      << stage_table(stages) << "\nweights in [" << c.min_weight << ", " << c.max_weight
      << "], rows sum to 1 within " << c.row_sum_error << ", " << c.repaired_rows
      << " rows repaired by at most " << c.repaired_largest_change << "\ndihedral angles "
      << c.min_dihedral_deg << " to " << c.max_dihedral_deg << " deg, positive off-diagonals "
      << c.positive_offdiagonal_share * 100 << " %\n"
      << spheres_line(model) << c.outside_vertices << " tissue vertices outside the mesh, the farthest "
      << c.max_outside_mm << " mm\n";
  return out.str();
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

// What killed runs left of the same output.
void sweep(const fs::path& output) {
  const fs::path folder = output.parent_path();
  files::remove_stale_parts(folder.empty() ? "." : folder, output.filename().string());
}

// What would fail only after minutes of work is refused first.
void check_outputs(const PreprocessSettings& settings) {
  if (settings.output.extension() != ".hdf") {
    throw Error(ErrorKind::usage, "--output", "'" + settings.output.string() + "' does not end in .hdf",
                "name it so: ParaView opens VTKHDF files by that ending");
  }
  const files::AtomicFile model(settings.output);
  sweep(settings.output);
  if (settings.report.empty()) return;
  if (settings.report.extension() != ".html") {
    throw Error(ErrorKind::usage, "--report", "'" + settings.report.string() + "' does not end in .html",
                "name it so");
  }
  const files::AtomicFile report(settings.report);
  sweep(settings.report);
}

// `context`, whose warnings are also put behind `warnings`.
Context noting(Context context, std::vector<std::string>& warnings) {
  context.log = [&warnings, said = std::move(context.log)](LogLevel level, std::string_view line) {
    if (level == LogLevel::warning) warnings.emplace_back(line);
    if (said) said(level, line);
  };
  return context;
}

// The worst tets beside the model that is not written, for ParaView.
std::string write_refused(const fs::path& output, const preprocess::WorstTets& worst) {
  const fs::path path = fs::path(output).replace_extension(".refused.vtu");
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

int run(const Program& program, const PreprocessSettings& settings) {
  check_outputs(settings);
  platform::use_big_heap();
  std::optional<StageFolder> kept;
  if (!settings.cache.empty()) kept.emplace(settings.cache, settings.cache_gib);
  std::vector<StageTime> stages;
  std::vector<std::string> warnings;
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
    return write_refused(settings.output, worst);
  };
  const preprocess::Result made = preprocess::run(patient, settings.options, context, hooks);
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
  if (!settings.report.empty()) {
    warnings.insert(warnings.end(), made.warnings.begin(), made.warnings.end());
    files::write_text(settings.report, report::page({made.model, stages, warnings}));
  }
  nlohmann::json report = model_report(true, &made.model, made.model.certificate, digests.size(), bad);
  for (const StageTime& s : stages) {
    report["stages"].push_back(
        {{"name", s.name}, {"seconds", s.seconds}, {"peak_rss_mib", s.peak_rss_mib}, {"kept", s.kept}});
  }
  report["peak_rss_mib"] = preprocess::peak_rss_mib();
  program.result(text_report(made.model, settings, stages), report);
  return 0;
}

// `cgal, lattice or ...` for help texts.
// 0, or a value in range: told as one thing.
template <class T>
CLI::Validator or_zero(const preprocess::Options::Range<T>& range, const std::string& unit) {
  std::ostringstream said;
  said << "0, or " << range.low << " to " << range.high;
  return {[said = said.str(), range, unit](std::string& text) -> std::string {
            T value{};
            const bool number = CLI::detail::lexical_cast(text, value);
            if (number && (value == T{} || (value >= range.low && value <= range.high))) return {};
            return "'" + text + "' is not " + said + " " + unit;
          },
          said.str()};
}

std::vector<std::string> strings(const std::vector<std::string_view>& names) {
  return {names.begin(), names.end()};
}

}  // namespace

void declare_preprocess(CLI::App& app, Program& program, Run& chosen) {
  using preprocess::Options;
  const auto settings = std::make_shared<PreprocessSettings>();
  CLI::App* command =
      app.add_subcommand("preprocess", "prepare a case for posing: rig, tets, weights, centres, mapping");
  command->add_option("CASE", settings->case_path, "a case.yaml, or the folder that holds one")->required();
  command->add_option("-o,--output", settings->output, "the model to write, ending in .hdf")->required();

  Options& o = settings->options;
  const auto meshers = tet::mesher_names();
  o.mesher = meshers.front();
  command->add_option("--mesher", o.mesher, "who makes the tets: " + text::joined(meshers))
      ->check(CLI::IsMember(strings(meshers)))
      ->capture_default_str();
  command
      ->add_option(
          "--voxel", o.voxel_mm,
          "voxel edge, mm; 0: the finest whose image stays within 250 x 120 x 700 voxels or their number")
      ->check(or_zero(Options::voxel_range, "mm"))
      ->capture_default_str();
  command
      ->add_option(
          "--max-tets", o.max_tets,
          "never more tets than this: sizes are coarsened until it holds; 0: two and a half for each "
          "vertex of the case, or a cube of twelve for each 3 x 3 x 3 voxels of the body in its finest "
          "image, from 300000 to 3500000")
      ->check(or_zero(Options::tets_range, "tets"))
      ->capture_default_str();
  command->add_option("--max-nodes", o.max_nodes, "never more nodes than this")
      ->check(CLI::Range(Options::nodes_range.low, Options::nodes_range.high))
      ->capture_default_str();
  std::vector<std::string> solvers = strings(weights::solver_names());
  solvers.insert(solvers.begin(), "auto");
  command
      ->add_option("--solver", o.solver,
                   "who solves for the weights: auto (" + solvers[1] + ", and amg for large meshes), " +
                       text::joined(weights::solver_names()))
      ->check(CLI::IsMember(solvers))
      ->capture_default_str();
  command
      ->add_option("--weights", o.weights,
                   "harmonic, or quasi-harmonic: they leave bones smoothly, in twice the time")
      ->check(CLI::IsMember(strings(weights::kind_names())))
      ->capture_default_str();
  command->add_option("--cor-sigma", o.cor_sigma, "width of the similarity of weights (LeHodgins16 eq. 1)")
      ->check(CLI::Range(Options::sigma_range.low, Options::sigma_range.high))
      ->capture_default_str();
  command
      ->add_option(
          "--spheres-by", o.spheres_by,
          "what the skeleton's voxels hang by: the largest skinning weight, or the nearest line from "
          "joint to joint that they see")
      ->check(CLI::IsMember({"weights", "bones"}))
      ->capture_default_str();
  command
      ->add_option("--spheres", o.spheres_tp,
                   "also thin the body to a volumetric skeleton of this thinness (0.48 is the paper's), for "
                   "pose --deformer spheres")
      ->check(CLI::Range(thin::least_thinness, thin::most_thinness));
  CLI::Option* cache = command->add_option("--cache", settings->cache,
                                           "a folder that keeps what the stages made: resumes an interrupted "
                                           "run and recomputes only what changed");
  command
      ->add_option("--cache-gib", settings->cache_gib,
                   "the folder's limit; what was not used for longest goes first")
      ->needs(cache)
      ->check(CLI::Range(0.01, 1e6))
      ->capture_default_str();
  command->add_option(
      "--report", settings->report,
      "a page (.html) of what was made: certificate, slices with bones and weights, rig, quality, "
      "times, warnings with pictures of where they are");
  command->add_flag("--check", settings->check,
                    "first look at the case as `ecorche check` does, and refuse what it calls an error");
  add_case_options(*command, settings->input);
  command->callback(
      [&program, &chosen, settings] { chosen = [&program, settings] { return run(program, *settings); }; });
}

}  // namespace ecorche::app
