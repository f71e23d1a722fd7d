// SPDX-License-Identifier: Apache-2.0
// The stages of a preparation as other libraries do them. Each returns the seconds that its own work took,
// without turning our arrays into its own, and says what it is.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::bench {

struct PeerRun {
  std::string version;    ///< empty: not in this build
  double seconds = 0;     ///< of what was done
  double share = 1;       ///< of the whole work that was done
  std::string did = {};   ///< what it found, for a reader to judge
  std::int64_t made = 0;  ///< tets of a mesher
};

/// Builds the locator (`vtkStaticCellLocator` or `vtkCellTreeLocator`) and looks every row of `points` up.
PeerRun vtk_locate(const Model& model, const Points& points, bool tree);

/// Skin, then each bone, as a level set of half a voxel's band by openvdb::tools::meshToVolume.
PeerRun openvdb_voxelize(const Case& patient, double voxel_mm);

/// igl::harmonic of the first order: `fixed` rows of V take the rows of `values`.
PeerRun libigl_harmonic(const Points& V, const Tets& T, const std::vector<std::int32_t>& fixed,
                        const Eigen::MatrixXd& values);

/// CGAL's Mesh_3 with all threads, perturbed, of the label image with such voxels; `near_mm` is the
/// circumradius at surfaces.
PeerRun cgal_parallel(const Case& patient, double voxel_mm, double near_mm);

/// LeHodgins16 eq. 1 over all tets, for `nodes` nodes spread evenly; `did` says how far ours is from it.
PeerRun brute_cor(const Model& model, std::int64_t nodes);

}  // namespace ecorche::bench
