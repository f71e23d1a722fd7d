// SPDX-License-Identifier: AGPL-3.0-or-later
// One peer of one stage: bench_preprocess PEER CASE MODEL RUNS prints one JSON object. bench/preprocess/run
// calls it.
#include <tbb/global_control.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include <ecorche/io/case_file.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/preprocess/pipeline.hpp>
#include "bench/preprocess/peers.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace ecorche::bench {
namespace {

constexpr std::int64_t kSampledNodes = 64;

// Vertices of the tissues that are bound to tets: what the stage `mapping` locates.
Points bound_points(const Model& model) {
  Eigen::Index rows = 0;
  const auto bound = [](const Tissue& tissue) { return tissue.segment == Tissue::by_tets; };
  for (const Tissue& tissue : model.tissues) rows += bound(tissue) ? tissue.V.rows() : 0;
  Points out(rows, 3);
  rows = 0;
  for (const Tissue& tissue : model.tissues) {
    if (!bound(tissue)) continue;
    out.middleRows(rows, tissue.V.rows()) = tissue.V.cast<double>();
    rows += tissue.V.rows();
  }
  return out;
}

PeerRun run_igl(const Case& patient, const Model& model) {
  const TetMesh mesh{model.nodes.cast<double>(), model.tets, model.tet_label};
  const std::vector<std::int32_t> owner = weights::bone_nodes(mesh, patient, model.bone_segment);
  std::vector<std::int32_t> fixed;
  for (std::size_t n = 0; n < owner.size(); ++n) {
    if (owner[n] >= 0) fixed.push_back(static_cast<std::int32_t>(n));
  }
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(fixed.size()),
                                                 static_cast<Eigen::Index>(model.segment_count()));
  for (std::size_t i = 0; i < fixed.size(); ++i)
    values(static_cast<Eigen::Index>(i), owner[static_cast<std::size_t>(fixed[i])]) = 1;
  return libigl_harmonic(mesh.V, mesh.T, fixed, values);
}

// As many tets as the model has, about: a first mesh tells how fine that is.
PeerRun run_cgal(const Case& patient, const Model& model) {
  const double voxel = std::stod(model.provenance.at("option/voxel_mm"));
  double near = 2.5 * voxel;
  PeerRun first = cgal_parallel(patient, voxel, near);
  if (first.version.empty()) return first;
  near *= std::cbrt(static_cast<double>(first.made) / static_cast<double>(model.tet_count()));
  return cgal_parallel(patient, voxel, near);
}

int run(const std::string& peer, const std::string& case_path, const std::string& model_path, int runs) {
  const Case patient = io::read_case(case_path, {}, {});
  const Model model = model_file::read(model_path, {});
  const Points points = bound_points(model);
  nlohmann::json out{{"peer", peer}, {"seconds", nlohmann::json::array()}};
  for (int i = 0; i < runs; ++i) {
    PeerRun one;
    if (peer == "vtk_static") one = vtk_locate(model, points, false);
    if (peer == "vtk_tree") one = vtk_locate(model, points, true);
    if (peer == "openvdb") one = openvdb_voxelize(patient, std::stod(model.provenance.at("option/voxel_mm")));
    if (peer == "libigl") one = run_igl(patient, model);
    if (peer == "cgal_parallel") one = run_cgal(patient, model);
    if (peer == "brute_cor") one = brute_cor(model, kSampledNodes);
    out["version"] = one.version;
    out["threads"] = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    out["did"] = one.did;
    out["share"] = one.share;
    if (one.version.empty()) break;
    out["seconds"].push_back(one.seconds / one.share);
    if (one.seconds > 30) break;  // slow enough for one run to tell
  }
  out["peak_mib"] = preprocess::peak_rss_mib();
  std::printf("%s\n", out.dump().c_str());
  return 0;
}

}  // namespace
}  // namespace ecorche::bench

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(
        stderr,
        "usage: bench_preprocess vtk_static|vtk_tree|openvdb|libigl|cgal_parallel|brute_cor CASE MODEL "
        "RUNS\n");
    return 64;
  }
  try {
    return ecorche::bench::run(argv[1], argv[2], argv[3], std::atoi(argv[4]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 70;
  }
}
