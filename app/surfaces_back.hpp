// SPDX-License-Identifier: Apache-2.0
// Posed surfaces of a model back to the scan, each by the way that it went.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include "app/posed_manifest.hpp"
#include "app/posed_tets.hpp"
#include "io/surface/tied_surfaces.hpp"

namespace ecorche::app {

/// How the vertices of one surface came back, held against the scan's.
struct SurfaceTrip {
  std::string tissue;
  Group group = Group::other;
  bool rigid = false;
  std::uint64_t vertices = 0, folded = 0;  ///< folded: in a tet that is (mapping::is_folded)
  double sum_mm = 0, max_mm = 0;           ///< of all vertices
  double folded_sum_mm = 0, folded_max_mm = 0;
};

/// A surface as LPS mm, whatever frame and unit its file says or its format fixes. Throws as
/// io::read_surface.
SurfaceMesh read_lps_surface(const std::filesystem::path& file);

class SurfacesBack {
 public:
  /// Reads the scan's surfaces of the posed body in `folder`. Throws Error{data} where they do not belong to
  /// the manifest or to `body`.
  SurfacesBack(const std::filesystem::path& folder, const PosedManifest& manifest, const PosedTets& body);

  struct Returned {
    SurfaceMesh mesh;                  ///< with the scan's triangles and numbering
    std::vector<std::uint8_t> folded;  ///< a vertex each
    SurfaceTrip trip;
  };
  /// `mesh`, of the file `where`, is the posed surface of `tissue`: a bone goes back by its segment's motion,
  /// what went by tets by those that carried it. Throws Error{data} for other triangles.
  Returned bring(const std::string& tissue, const SurfaceMesh& mesh, const std::string& where,
                 const Context& context) const;

 private:
  const PosedManifest& manifest_;
  const PosedTets& body_;
  io::TiedSurfaces scan_;
  struct Part {
    Eigen::Index vertex = 0, triangle = 0;  // the first of the tissue
  };
  std::vector<Part> parts_;  // one for each surface of the manifest
};

}  // namespace ecorche::app
