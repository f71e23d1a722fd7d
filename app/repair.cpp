// SPDX-License-Identifier: Apache-2.0
// `ecorche repair`: a case in, a mended case out, and a list of what was done.
#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <filesystem>
#include <mutex>

#include <ecorche/io/case_file.hpp>
#include <ecorche/values/error.hpp>
#include "app/case_options.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "core/geometry/hole_size.hpp"
#include "preprocess/check/surface_figures.hpp"
#include "preprocess/label_surfaces/label_surfaces.hpp"
#include "preprocess/repair/repair_surface.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

struct RepairSettings {
  fs::path path, output;
  io::CaseOptions input;
  repair::Options options;
  bool dry_run = false;
};

struct Line {
  std::string name;
  repair::Done done;
  check::SurfaceFigures after;
  geometry::LargestHole left;  // of the holes that are still there
};

// Every word of the report: its key under --json, its column, its count.
struct Column {
  const char *key, *title;
  std::int64_t repair::Done::*count;
};
constexpr Column kColumns[] = {
    {"welded_vertices", "welded", &repair::Done::welded},
    {"degenerate_dropped", "degen.", &repair::Done::degenerate},
    {"duplicates_dropped", "dupl.", &repair::Done::duplicates},
    {"fins_dropped", "fins", &repair::Done::fins},
    {"triangles_turned", "turned", &repair::Done::turned},
    {"vertices_split", "split", &repair::Done::split},
    {"specks_dropped", "specks", &repair::Done::specks},
    {"holes_filled", "holes", &repair::Done::holes},
    {"filling_triangles", "filling", &repair::Done::filling},
    {"flat_swapped", "flat", &repair::Done::flat},
    {"inner_dropped", "inner", &repair::Done::inner},
    {"parts_turned_outward", "outward", &repair::Done::outward},
};

// A case is never written over another, least of all over the one that is read.
void check_output(const RepairSettings& settings) {
  std::error_code ignored;
  const fs::path input =
      fs::is_directory(settings.path, ignored) ? settings.path : settings.path.parent_path();
  const auto same = [&](const fs::path& folder) {
    return fs::equivalent(settings.output, folder.empty() ? fs::path(".") : folder, ignored);
  };
  if (same(input) || (!settings.input.data.empty() && same(settings.input.data))) {
    throw Error(ErrorKind::usage, "--output", "'" + settings.output.string() + "' holds the input",
                "name another folder: repair never writes over what it reads");
  }
  if (fs::exists(settings.output / "case.yaml", ignored)) {
    throw Error(ErrorKind::cannot_create, settings.output.string(), "holds a case already",
                "name another folder, or remove it");
  }
}

std::vector<Line> mend(Case& patient, const RepairSettings& settings, const Context& context) {
  std::vector<SurfaceMesh*> meshes{&patient.skin};
  std::vector<Line> lines{{patient.skin_name, {}, {}, {}}};
  for (CaseBone& bone : patient.bones) {
    meshes.push_back(&bone.surface);
    lines.push_back({bone.name, {}, {}, {}});
  }
  for (CaseTissue& tissue : patient.tissues) {
    meshes.push_back(&tissue.surface);
    lines.push_back({tissue.name, {}, {}, {}});
  }
  std::mutex mutex;
  std::size_t finished = 0;
  tbb::parallel_for(std::size_t{0}, meshes.size(), [&](std::size_t i) {
    context.check_stop();
    repair::Mended mended = repair::repair_surface(*meshes[i], settings.options, context);
    lines[i].done = mended.done;
    lines[i].after = check::measure(mended.mesh);
    if (lines[i].after.open.count > 0) lines[i].left = geometry::largest_hole(mended.mesh);
    if (mended.done.anything()) *meshes[i] = std::move(mended.mesh);
    const std::lock_guard lock(mutex);
    context.report(static_cast<double>(++finished) / static_cast<double>(meshes.size()));
  });
  return lines;
}

// `--holes` that fills the largest hole, with room for what rounding does; 0 where none can.
double holes_option(const geometry::LargestHole& hole) {
  const double edge = std::ceil(1.05 * hole.filling_edge * 100) / 100;
  return hole.filling_edge > 0 && edge <= repair::Options::hole_range.high ? edge : 0;
}

std::string left_open(const Line& line) {
  const geometry::LargestHole& hole = line.left;
  const double option = holes_option(hole);
  std::string out =
      fmt::format("{}: {} {} left", line.name, hole.holes, hole.holes == 1 ? "hole is" : "holes are");
  if (hole.edges > 0)
    out += fmt::format(", the largest of {} edges at [{:.2f}, {:.2f}, {:.2f}]", hole.edges, hole.middle.x(),
                       hole.middle.y(), hole.middle.z());
  if (option > 0) out += fmt::format(": --holes {:g} fills {}", option, hole.holes == 1 ? "it" : "them");
  if (!hole.closed || option == 0) out += "; some of their edges form no loop, which nothing here fills";
  return out;
}

std::string text_report(const std::vector<Line>& lines, const RepairSettings& settings) {
  std::string out = fmt::format("{:<24}", "surface");
  for (const Column& column : kColumns) out += fmt::format(" {:>7}", column.title);
  out += fmt::format(" {:>10} {:>10}\n", "open left", "n-m. left");
  std::size_t untouched = 0;
  for (const Line& line : lines) {
    if (!line.done.anything() && line.after.closed()) {
      ++untouched;
      continue;
    }
    out += fmt::format("{:<24}", line.name);
    for (const Column& column : kColumns) out += fmt::format(" {:>7}", line.done.*column.count);
    out += fmt::format(" {:>10} {:>10}\n", line.after.open.count, line.after.nonmanifold.count);
  }
  for (const Line& line : lines) {
    if (line.after.open.count > 0) out += left_open(line) + "\n";
  }
  out += fmt::format("{} of {} surfaces needed nothing\n", untouched, lines.size());
  out +=
      settings.dry_run ? "nothing was written (--dry-run)\n" : settings.output.string() + ": a whole case\n";
  return out;
}

nlohmann::json json_report(const std::vector<Line>& lines) {
  nlohmann::json out = nlohmann::json::array();
  for (const Line& line : lines) {
    nlohmann::json entry{{"name", line.name}, {"changed", line.done.anything()}};
    for (const Column& column : kColumns) entry[column.key] = line.done.*column.count;
    entry["holes_left"] = line.done.holes_left;
    entry["holes_option"] = holes_option(line.left) > 0 ? nlohmann::json(holes_option(line.left)) : nullptr;
    entry["open_edges_left"] = line.after.open.count;
    entry["nonmanifold_edges_left"] = line.after.nonmanifold.count;
    entry["flipped_edges_left"] = line.after.flipped.count;
    out.push_back(entry);
  }
  return out;
}

int run(const Program& program, const RepairSettings& settings) {
  if (settings.output.empty() && !settings.dry_run) {
    throw Error(ErrorKind::usage, "--output", "is missing",
                "name a folder for the mended case, or use --dry-run");
  }
  if (!settings.output.empty()) check_output(settings);
  Case patient = io::read_case(settings.path, settings.input, program.context("read"));
  label_surfaces::resolve(patient, program.context("surfaces"));
  const std::vector<Line> lines = mend(patient, settings, program.context("repair"));
  if (!settings.dry_run) io::write_case(settings.output, patient, program.context("write"));
  program.result(text_report(lines, settings),
                 {{"ok", true}, {"written", !settings.dry_run}, {"surfaces", json_report(lines)}});
  return 0;
}

}  // namespace

void declare_repair(CLI::App& app, Program& program, Run& chosen) {
  using repair::Options;
  const auto settings = std::make_shared<RepairSettings>();
  CLI::App* command = app.add_subcommand("repair", "mend the surfaces of a case and write it as a new one");
  command->add_option("CASE", settings->path, "a case.yaml, or the folder that holds one")->required();
  command->add_option("-o,--output", settings->output, "the folder for the mended case");
  Options& o = settings->options;
  const auto number = [&](const char* name, double& value, const Options::Range& range, const char* help) {
    command->add_option(name, value, help)->check(CLI::Range(range.low, range.high))->capture_default_str();
  };
  number("--weld", o.weld_mm, Options::weld_range,
         "mm: vertices of open edges that lie nearer than this become one");
  number("--holes", o.hole_mm, Options::hole_range,
         "mm: holes no larger than a square of this edge are filled; 0: none");
  number("--specks", o.speck_mm, Options::speck_range,
         "mm: parts smaller than this across are dropped; 0: none");
  command->add_flag("--drop-inner", o.drop_inner, "drop closed parts inside others: fills cavities");
  command->add_flag("--dry-run", settings->dry_run, "say what would be done; write nothing");
  add_case_options(*command, settings->input);
  command->callback(
      [&program, &chosen, settings] { chosen = [&program, settings] { return run(program, *settings); }; });
}

}  // namespace ecorche::app
