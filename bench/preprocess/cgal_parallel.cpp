// SPDX-License-Identifier: AGPL-3.0-or-later
// CGAL's Mesh_3 on all cores: another mesh every time, so that it is a peer here and no mesher of ours.
#include "bench/preprocess/peers.hpp"

#ifdef CGAL_LINKED_WITH_TBB
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/make_mesh_3.h>
#include <CGAL/version.h>

#include <chrono>
#include <cmath>

#include "preprocess/tet/image/label_field.hpp"
#include "preprocess/tet/image/surface_distance.hpp"
#include "preprocess/voxel/voxelize.hpp"
#endif

namespace ecorche::bench {

#ifdef CGAL_LINKED_WITH_TBB
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain, CGAL::Default, CGAL::Parallel_tag>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

// Circumradius wanted at a place, mm: as our own use of Mesh_3 asks it (preprocess/tet/cgal).
struct Sizing {
  using FT = Kernel::FT;
  const ImageGrid* grid;
  const std::vector<std::uint8_t>* thirds;  // of a voxel, to the nearest surface
  double near;

  template <class Index>
  FT operator()(const Kernel::Point_3& p, int, const Index&) const {
    int at[3];
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      const double voxel = (p[axis] - grid->origin[a]) / grid->spacing[a];
      at[a] = std::clamp(static_cast<int>(std::lround(voxel)), 0, grid->size[a] - 1);
    }
    const double away = (*thirds)[grid->offset(at[0], at[1], at[2])] / 3.0 * grid->spacing[0] - near;
    return std::min(near + 0.35 * std::max(0.0, away), 8 * near);
  }
};

}  // namespace

PeerRun cgal_parallel(const Case& patient, double voxel_mm, double near_mm) {
  namespace p = CGAL::parameters;
  voxel::Options options;
  options.voxel_mm = voxel_mm;
  const Image labels = voxel::voxelize(patient, options, {});
  const ImageGrid& grid = labels.grid;
  const std::vector<std::uint8_t> distance = tet::surface_distance(labels, {});
  const tet::LabelField field(labels);
  const auto low = grid.point(0, 0, 0),
             high = grid.point(grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1);
  PeerRun run{"CGAL Mesh_3 " CGAL_VERSION_STR ", parallel"};
  const auto start = std::chrono::steady_clock::now();
  const Domain domain(
      [&](const Kernel::Point_3& at) { return static_cast<int>(field(at.x(), at.y(), at.z())); },
      CGAL::Bbox_3(low[0], low[1], low[2], high[0], high[1], high[2]), p::relative_error_bound = 1e-5);
  const Criteria criteria(p::facet_angle = 25, p::facet_size = near_mm,
                          p::facet_distance = std::max(0.4 * grid.spacing[0], 0.2 * near_mm),
                          p::cell_radius_edge_ratio = 2, p::cell_size = Sizing{&grid, &distance, near_mm});
  const auto mesh = CGAL::make_mesh_3<Complex>(domain, criteria, p::no_exude(), p::perturb());
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  run.made = static_cast<std::int64_t>(mesh.number_of_cells_in_complex());
  run.did = std::to_string(run.made) + " tets";
  return run;
}
#else
PeerRun cgal_parallel(const Case&, double, double) {
  return {};
}
#endif

}  // namespace ecorche::bench
