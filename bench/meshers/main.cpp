// SPDX-License-Identifier: Apache-2.0
// All meshers on one case, by the measures that a default is chosen by.
//
// usage: bench_meshers CASE [--data DIR] [--meshers A,B] [--voxel MM] [--max-tets N] [--seconds S]
// [--weights]
//
// Meshes are as the pipeline makes them: meshed, worst tets relaxed, nodes in float32. Times are of all that.
// Distances are in voxels, two-sided, 99th percentile of points drawn by area over what is at least a voxel
// thick; bones that are not, over a tenth of their area, are listed with theirs.
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
#include "preprocess/label_surfaces/label_surfaces.hpp"
#include "preprocess/tet/mesher.hpp"
#include "preprocess/tet/relax_slivers.hpp"
#include "preprocess/voxel/voxelize.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace {

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
void print_weights(const Case& patient, const TetMesh& mesh, bool solve) {
  double share = 0;
  weights::stiffness(mesh.V, mesh.T, {}, &share);
  std::printf(" %9.4f", 100 * share);
  if (!solve) return;
  std::map<std::string, std::int32_t> rows;
  std::vector<std::int32_t> owner;
  for (const CaseBone& bone : patient.bones)
    owner.push_back(rows.try_emplace(bone.segment, static_cast<std::int32_t>(rows.size())).first->second);
  try {
    const Certificate c = weights::solve_weights(mesh, patient, owner, rows.size(), {}, {}).certificate;
    std::printf(" %9.1e %9.1e %6llu", c.solved_min_weight, c.solved_max_weight - 1,
                static_cast<unsigned long long>(c.repaired_rows));
  } catch (const Error& e) {
    std::printf(" refused: %s", e.what());
  }
}

void print_fits(const std::vector<bench::SurfaceFit>& all) {
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
  std::printf(" | skin %.2f %+.2f %%", worst(all[0]), 100 * all[0].volume_error);
  if (last != nullptr)
    std::printf(" | bones median %.2f, %zu of %zu within 0.6, worst %.2f (%s); volume median %.1f %%",
                of_bones[of_bones.size() / 2], within, all.size() - 1, worst(*last), last->name.c_str(),
                100 * volumes[volumes.size() / 2]);
  std::printf("\n");
  for (const bench::SurfaceFit& f : all) {
    if (!f.there) std::printf("    %s: no tet of it\n", f.name.c_str());
    if (f.there && f.thin_share > 0.1)
      std::printf("    %s: %.0f %% thinner than a voxel, %.2f voxel there\n", f.name.c_str(),
                  100 * f.thin_share, f.thin_p99);
  }
}

int run(const Settings& s) {
  Case patient = io::read_case(s.path, s.input, {});
  label_surfaces::resolve(patient, {});
  voxel::Options options;
  options.voxel_mm = s.voxel;
  const Image labels = voxel::voxelize(patient, options, {});
  const double voxel = labels.grid.spacing[0];
  std::printf("%s: voxels of %.3f mm, at most %lld tets\n", patient.name.c_str(), voxel,
              static_cast<long long>(s.options.max_tets));
  std::printf("%-12s %8s %8s %8s %7s %6s %6s %6s %6s %9s%s\n", "mesher", "tets", "nodes", "seconds", "least",
              "1 %", "most", "ratio", "mean", "offdiag %", s.weights ? "  below 0   above 1 repair" : "");
  for (const std::string& name : s.meshers) {
    const auto start = std::chrono::steady_clock::now();
    TetMesh mesh;
    try {
      mesh = tet::make_mesher(name)->mesh({patient, labels}, s.options, {});
      tet::relax_slivers(mesh, {}, {});
      tet::canonicalize(mesh);
    } catch (const Error& e) {
      std::printf("%-12s %s\n", name.c_str(), e.what());
      continue;
    }
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    const bench::Shapes shapes = bench::shapes(mesh);
    std::printf("%-12s %8lld %8lld %8.2f %7.2f %6.1f %6.1f %6.3f %6.3f", name.c_str(),
                static_cast<long long>(mesh.T.rows()), static_cast<long long>(mesh.V.rows()), spent.count(),
                shapes.least_deg, shapes.hundredth_deg, shapes.greatest_deg, shapes.least_ratio,
                shapes.mean_ratio);
    print_weights(patient, mesh, s.weights);
    print_fits(bench::fits(patient, mesh, voxel, kSamples));
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const tbb::global_control two(tbb::global_control::max_allowed_parallelism, 2);
    return run(parse(argc, argv));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "error: bench_meshers: %s\n", e.what());
    return 1;
  }
}
