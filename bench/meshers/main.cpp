// SPDX-License-Identifier: Apache-2.0
// All meshers on one case, by the measures that a default is chosen by.
//
// usage: bench_meshers CASE [--data DIR] [--meshers A,B] [--voxel MM] [--max-tets N] [--seconds S]
// [--weights]
//
// Meshes are as the pipeline makes them: meshed, worst tets relaxed, nodes in float32. Times are of all that.
// Distances are in voxels, two-sided, 99th percentile of points drawn by area over what is at least a voxel
// thick; bones that are not, over a tenth of their area, are listed below the table with theirs.
#include <tbb/global_control.h>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <ecorche/io/case_file.hpp>
#include "bench/meshers/measures.hpp"
#include "bench/table.hpp"
#include "preprocess/label_surfaces/label_surfaces.hpp"
#include "preprocess/tet/mesher.hpp"
#include "preprocess/tet/relax_slivers.hpp"
#include "preprocess/voxel/voxelize.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace {

constexpr std::size_t kThinNamed = 3;

using namespace ecorche;

constexpr std::size_t kSamples = 40'000;  // a surface and direction

struct Settings {
  std::string path;
  io::CaseOptions input;
  std::vector<std::string> meshers;
  double voxel = 0;
  bool weights = false;
  tet::Options options;
};

Settings parse(int argc, char** argv) {
  Settings s;
  for (const std::string_view name : tet::mesher_names()) s.meshers.emplace_back(name);
  for (int n = 1; n < argc; ++n) {
    const std::string word = argv[n];
    const auto value = [&]() -> std::string {
      if (n + 1 >= argc) throw Error(ErrorKind::usage, word, "no value", "give one");
      return argv[++n];
    };
    if (word == "--data") {
      s.input.data = value();
    } else if (word == "--meshers") {
      s.meshers.clear();
      std::istringstream list(value());
      for (std::string name; std::getline(list, name, ',');) s.meshers.push_back(name);
    } else if (word == "--voxel") {
      s.voxel = std::stod(value());
    } else if (word == "--max-tets") {
      s.options.max_tets = std::stoll(value());
    } else if (word == "--seconds") {
      s.options.seconds = std::stod(value());
    } else if (word == "--weights") {
      s.weights = true;
    } else {
      s.path = word;
    }
  }
  return s;
}

/// Off-diagonals, and with --weights how far harmonic weights leave [0, 1].
void add_weights(const Case& patient, const TetMesh& mesh, bool solve, std::vector<std::string>& cells) {
  double share = 0;
  weights::stiffness(mesh.V, mesh.T, {}, &share);
  cells.push_back(bench::fixed(100 * share, 4));
  if (!solve) return;
  std::map<std::string, std::int32_t> rows;
  std::vector<std::int32_t> owner;
  for (const CaseBone& bone : patient.bones)
    owner.push_back(rows.try_emplace(bone.segment, static_cast<std::int32_t>(rows.size())).first->second);
  try {
    const Certificate c = weights::solve_weights(mesh, patient, owner, rows.size(), {}, {}).certificate;
    cells.insert(cells.end(), {bench::exponent(c.solved_min_weight, 1),
                               bench::exponent(c.solved_max_weight - 1, 1), std::to_string(c.repaired_rows)});
  } catch (const Error&) {
    cells.insert(cells.end(), {"refused", "", ""});
  }
}

void add_fits(const std::vector<bench::SurfaceFit>& all, const std::string& mesher,
              std::vector<std::string>& cells, std::vector<std::string>& notes) {
  const auto worst = [](const bench::SurfaceFit& f) { return std::max(f.to_mesh_p99, f.to_input_p99); };
  std::vector<double> of_bones, volumes;
  const bench::SurfaceFit* last = nullptr;
  std::size_t within = 0;
  for (std::size_t s = 1; s < all.size(); ++s) {
    of_bones.push_back(worst(all[s]));
    volumes.push_back(std::abs(all[s].volume_error));
    within += all[s].there && worst(all[s]) <= 0.6 ? 1 : 0;
    if (last == nullptr || worst(all[s]) > worst(*last)) last = &all[s];
  }
  std::sort(of_bones.begin(), of_bones.end());
  std::sort(volumes.begin(), volumes.end());
  using bench::fixed;
  cells.insert(cells.end(), {fixed(worst(all[0]), 2), fixed(100 * all[0].volume_error, 2)});
  if (last != nullptr)
    cells.insert(cells.end(),
                 {fixed(of_bones[of_bones.size() / 2], 2),
                  std::to_string(within) + " of " + std::to_string(all.size() - 1),
                  fixed(worst(*last), 2) + " " + last->name, fixed(100 * volumes[volumes.size() / 2], 1)});
  std::string none;
  std::vector<const bench::SurfaceFit*> thin;
  for (const bench::SurfaceFit& f : all) {
    if (!f.there) none += (none.empty() ? "" : ", ") + f.name;
    if (f.there && f.thin_share > 0.1) thin.push_back(&f);
  }
  if (!none.empty()) notes.push_back(mesher + ": no tet of " + none);
  if (thin.empty()) return;
  std::stable_sort(thin.begin(), thin.end(),
                   [](const auto* a, const auto* b) { return a->thin_share > b->thin_share; });
  std::string said =
      mesher + ": " + std::to_string(thin.size()) +
      " bones are thinner than a voxel over a tenth and more, most of all (share, distance there in voxels)";
  for (std::size_t i = 0; i < std::min(kThinNamed, thin.size()); ++i)
    said += (i == 0 ? " " : "; ") + thin[i]->name + " " + fixed(100 * thin[i]->thin_share, 0) + " %, " +
            fixed(thin[i]->thin_p99, 2);
  notes.push_back(said);
}

int run(const Settings& s) {
  Case patient = io::read_case(s.path, s.input, {});
  label_surfaces::resolve(patient, {});
  voxel::Options options;
  options.voxel_mm = s.voxel;
  const Image labels = voxel::voxelize(patient, options, {});
  const double voxel = labels.grid.spacing[0];
  std::printf("\n%s: voxels of %.3f mm, at most %lld tets\n", patient.name.c_str(), voxel,
              static_cast<long long>(s.options.max_tets));
  std::vector<bench::Column> columns{
      {"mesher", 14}, {"tets", 8}, {"nodes", 8}, {"seconds"}, {"least deg"},
      {"1 %"},        {"most"},    {"ratio"},    {"mean"},    {"positive off-diagonals %"}};
  if (s.weights) columns.insert(columns.end(), {{"weights below 0"}, {"above 1"}, {"repaired"}});
  columns.insert(columns.end(), {{"skin, voxels"},
                                 {"skin's volume %"},
                                 {"bones, median"},
                                 {"within 0.6"},
                                 {"worst", -24},
                                 {"bones' volume, median %"}});
  const bench::Table table(columns);
  std::vector<std::string> notes;
  for (const std::string& name : s.meshers) {
    const auto start = std::chrono::steady_clock::now();
    TetMesh mesh;
    try {
      mesh = tet::make_mesher(name)->mesh({patient, labels}, s.options, {});
      tet::relax_slivers(mesh, {}, {});
      tet::canonicalize(mesh);
    } catch (const Error& e) {
      table.row({name, "refused"});
      notes.push_back(name + ": " + e.what());
      continue;
    }
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    const bench::Shapes shapes = bench::shapes(mesh);
    using bench::fixed;
    std::vector<std::string> cells{name,
                                   std::to_string(mesh.T.rows()),
                                   std::to_string(mesh.V.rows()),
                                   fixed(spent.count(), 2),
                                   fixed(shapes.least_deg, 2),
                                   fixed(shapes.hundredth_deg, 1),
                                   fixed(shapes.greatest_deg, 1),
                                   fixed(shapes.least_ratio, 3),
                                   fixed(shapes.mean_ratio, 3)};
    add_weights(patient, mesh, s.weights, cells);
    add_fits(bench::fits(patient, mesh, voxel, kSamples), name, cells, notes);
    table.row(cells);
  }
  bench::print_notes(notes);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const tbb::global_control two(tbb::global_control::max_allowed_parallelism, 2);
    return run(parse(argc, argv));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "error: bench_meshers: %s\n", e.what());
    return 70;
  }
}
