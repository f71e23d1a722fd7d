// SPDX-License-Identifier: Apache-2.0
// `ecorche preprocess`: a case in, a model out.
#include <ecorche/preprocess/pipeline.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/case_options.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/mesh_options.hpp"
#include "app/model_report.hpp"
#include "app/prepare_model.hpp"
#include "app/report/page.hpp"
#include "core/files/atomic_file.hpp"
#include "core/files/stale_parts.hpp"
#include "core/platform/heap.hpp"
#include "core/values/text.hpp"
#include "preprocess/thin/thinning.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using preprocess::StageTime;

struct PreprocessSettings : PrepareSettings {
  fs::path report;  // empty: none
};

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

int run(const Program& program, PreprocessSettings& settings) {
  const auto start = std::chrono::steady_clock::now();
  check_outputs(settings);
  platform::use_big_heap();
  settings.refused = fs::path(settings.output).replace_extension(".refused.vtu");
  const PreparedModel made = prepare_model(program, settings);
  if (!settings.report.empty())
    files::write_text(settings.report, report::page({made.model, made.stages, made.warnings}));
  nlohmann::json report = model_report(true, &made.model, made.model.certificate, made.digests, 0);
  for (const StageTime& s : made.stages) {
    report["stages"].push_back(
        {{"name", s.name}, {"seconds", s.seconds}, {"peak_rss_mib", s.peak_rss_mib}, {"kept", s.kept}});
  }
  report["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  report["peak_rss_mib"] = preprocess::peak_rss_mib();
  program.result(text_report(made.model, settings, made.stages), report);
  return 0;
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
  add_mesh_options(*command, o);
  std::vector<std::string> solvers = owned(weights::solver_names());
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
      ->check(CLI::IsMember(owned(weights::kind_names())))
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
