// SPDX-License-Identifier: Apache-2.0
#include "preprocess/provenance.hpp"
#include <ecorche/version.hpp>
#include "core/values/text.hpp"

#include <Eigen/Core>

namespace ecorche::preprocess {
namespace {

std::string eigen_version() {
  return std::to_string(EIGEN_WORLD_VERSION) + "." + std::to_string(EIGEN_MAJOR_VERSION) + "." +
         std::to_string(EIGEN_MINOR_VERSION);
}

}  // namespace

std::map<std::string, std::string> provenance(const Case& patient, const Options& options,
                                              std::string_view mesher, std::string_view solver,
                                              double voxel_mm) {
  std::map<std::string, std::string> out;
  out["ecorche"] = ECORCHE_VERSION;
  out["option/mesher"] = mesher;
  out["option/solver"] = solver;
  out["option/weights"] = options.weights;
  out["option/voxel_mm"] = text::shortest(voxel_mm);
  out["option/max_tets"] = std::to_string(options.max_tets);
  out["option/max_nodes"] = std::to_string(options.max_nodes);
  out["option/cor_sigma"] = text::shortest(options.cor_sigma);
  if (options.spheres_tp) {
    out["option/spheres_tp"] = text::shortest(*options.spheres_tp);
    out["option/spheres_by"] = options.spheres_by;
  }
  out["library/eigen"] = eigen_version();
#ifdef ECORCHE_GPL
  if (mesher == "cgal") out["library/cgal"] = ECORCHE_CGAL_VERSION;
  if (mesher == "tetgen") out["library/tetgen"] = ECORCHE_TETGEN_VERSION;
  if (solver == "cholmod") out["library/cholmod"] = ECORCHE_CHOLMOD_VERSION;
#endif
  for (const auto& [path, digest] : patient.input_digests) out["input/" + path] = text::hex(digest);
  return out;
}

}  // namespace ecorche::preprocess
