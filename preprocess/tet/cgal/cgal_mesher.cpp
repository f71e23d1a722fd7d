// SPDX-License-Identifier: AGPL-3.0-or-later
// Delaunay refinement of the label image by CGAL's Mesh_3, sequential: the same input gives the same mesh.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Random.h>
#include <CGAL/make_mesh_3.h>
#include <CGAL/perturb_mesh_3.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>
#include <vector>

#include "preprocess/tet/image/label_field.hpp"
#include "preprocess/tet/image/seed_points.hpp"
#include "preprocess/tet/image/surface_distance.hpp"
#include "preprocess/tet/mesher.hpp"
#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::tet {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain, CGAL::Default, CGAL::Sequential_tag>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
using Point = Kernel::Point_3;

constexpr double kFinestInVoxels = 1.3;  // circumradius at surfaces: finer shows the voxels' steps
constexpr double kGrowth = 0.35;         // mm of circumradius per mm of distance from a surface
constexpr double kLargest = 8;           // circumradius far from surfaces, in those at surfaces
constexpr double kTetsPerRadius3 = 6.6;  // measured on bodies: tets over volume / radius^3
constexpr double kNodesPerTet = 0.22;    // measured, with much boundary; 0.17 without
constexpr double kRoom = 0.93;           // of the allowed number is aimed at
constexpr double kSliverBound = 10;      // degrees, of the smallest dihedral angle

/// Circumradius wanted at a place, mm: `near` at surfaces, growing with the distance from them.
class Sizing {
 public:
  using FT = Kernel::FT;
  Sizing(const Image& labels, const std::vector<std::uint8_t>& distance, double near)
      : grid_(&labels.grid), distance_(&distance), near_(near) {}

  template <class Index>
  FT operator()(const Point& p, int /*dimension*/, const Index& /*index*/) const {
    const double at[3] = {p.x(), p.y(), p.z()};
    int index[3];
    for (std::size_t axis = 0; axis < 3; ++axis)
      index[axis] =
          std::clamp(static_cast<int>(std::lround((at[axis] - grid_->origin[axis]) / grid_->spacing[axis])),
                     0, grid_->size[axis] - 1);
    return radius((*distance_)[grid_->offset(index[0], index[1], index[2])]);
  }

  double radius(std::uint8_t thirds) const {
    const double away = thirds / 3.0 * grid_->spacing[0] - near_;
    return std::min(near_ + kGrowth * std::max(0.0, away), kLargest * near_);
  }

 private:
  const ImageGrid* grid_;
  const std::vector<std::uint8_t>* distance_;
  double near_;
};

/// Tets to expect of a sizing.
double expected_tets(const Image& labels, const std::vector<std::uint8_t>& distance, double near) {
  const Sizing sizing(labels, distance, near);
  const std::span<const std::uint16_t> voxels = labels.scalars<std::uint16_t>();
  std::array<std::int64_t, 256> at_distance{};
  for (std::size_t v = 0; v < voxels.size(); ++v)
    if (voxels[v] != voxel::outside) ++at_distance[distance[v]];
  const double h = labels.grid.spacing[0];
  double sum = 0;
  for (std::size_t d = 0; d < at_distance.size(); ++d)
    sum += static_cast<double>(at_distance[d]) * std::pow(h / sizing.radius(static_cast<std::uint8_t>(d)), 3);
  return kTetsPerRadius3 * sum;
}

/// The finest circumradius at surfaces that is expected to keep the limit.
double choose_near(const Image& labels, const std::vector<std::uint8_t>& distance, double allowed) {
  double near = kFinestInVoxels * labels.grid.spacing[0];
  while (expected_tets(labels, distance, near) > kRoom * allowed) near *= 1.02;
  return near;
}

/// The smallest dihedral angle, with a look at the stop request: perturbing calls nothing else of ours.
class WatchedDihedral : public CGAL::Mesh_3::Min_dihedral_angle_criterion<Triangulation> {
 public:
  using Base = CGAL::Mesh_3::Min_dihedral_angle_criterion<Triangulation>;
  WatchedDihedral(double bound, const Triangulation& triangulation, const Context& context)
      : Base(bound, triangulation), context_(&context) {}
  using Base::operator();
  double operator()(const Base::Tetrahedron_3& t) const override {
    context_->check_stop();
    return Base::operator()(t);
  }

 private:
  const Context* context_;
};

/// One run of Mesh_3 at one size.
class Run {
 public:
  Run(const Image& labels, const std::vector<std::uint8_t>& distance, double near, const Context& context)
      : labels_(labels), field_(labels), distance_(distance), near_(near), context_(context) {
    expected_nodes_ = kNodesPerTet * expected_tets(labels, distance, near);
  }

  TetMesh mesh() {
    namespace p = CGAL::parameters;
    CGAL::get_default_random() = CGAL::Random(0);
    const ImageGrid& grid = labels_.grid;
    const auto low = grid.point(0, 0, 0),
               high = grid.point(grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1);
    const Domain domain(
        [this](const Point& at) {
          if ((++looks_ & 0x3ff) == 0) watch();
          return static_cast<int>(field_(at.x(), at.y(), at.z()));
        },
        CGAL::Bbox_3(low[0], low[1], low[2], high[0], high[1], high[2]), p::relative_error_bound = 1e-5);
    const double voxel = grid.spacing[0];
    const Criteria criteria(p::facet_angle = 25, p::facet_size = near_,
                            p::facet_distance = std::max(0.4 * voxel, 0.2 * near_),
                            p::cell_radius_edge_ratio = 2, p::cell_size = Sizing(labels_, distance_, near_));
    seed(domain);
    refine_mesh_3(complex_, domain, criteria, p::no_exude(), p::no_perturb(), p::no_reset_c3t3());
    refined_ = true;
    context_.report(0.7);
    const WatchedDihedral slivers(kSliverBound, complex_.triangulation(), context_);
    CGAL::perturb_mesh_3(complex_, domain, p::sliver_criterion = slivers);
    context_.report(0.85);
    // Not exuded: on bodies CGAL 5.5's exuder can pump one vertex for ever, and its order hangs on addresses.
    // What is left of the slivers, relax_slivers mends.
    return gather();
  }

 private:
  void watch() {
    context_.check_stop();
    if (!refined_)
      context_.report(0.7 * std::min(1.0, static_cast<double>(complex_.triangulation().number_of_vertices()) /
                                              expected_nodes_));
  }

  /// First points on every boundary of every part of every label: refinement finds the rest, but never a part
  /// that no edge of the first Voronoi diagram meets.
  void seed(const Domain& domain) {
    const auto intersection = domain.construct_intersection_object();
    Triangulation& triangulation = complex_.triangulation();
    for (const BoundaryStep& step : seed_steps(labels_, 2 * near_, context_)) {
      const Domain::Intersection hit = intersection(Kernel::Segment_3(
          {step.from[0], step.from[1], step.from[2]}, {step.to[0], step.to[1], step.to[2]}));
      if (std::get<2>(hit) == 0) continue;
      const auto vertex = triangulation.insert(Triangulation::Weighted_point(std::get<0>(hit)));
      if (vertex == Triangulation::Vertex_handle()) continue;  // hidden
      complex_.set_dimension(vertex, 2);
      complex_.set_index(vertex, std::get<1>(hit));
    }
  }

  TetMesh gather() const {
    TetMesh mesh;
    std::unordered_map<Triangulation::Vertex_handle, std::int32_t> number;
    std::vector<Point> points;
    mesh.T.resize(static_cast<Eigen::Index>(complex_.number_of_cells_in_complex()), 4);
    mesh.label.reserve(complex_.number_of_cells_in_complex());
    Eigen::Index t = 0;
    for (auto cell = complex_.cells_in_complex_begin(); cell != complex_.cells_in_complex_end();
         ++cell, ++t) {
      for (int c = 0; c < 4; ++c) {
        const auto [entry, fresh] =
            number.try_emplace(cell->vertex(c), static_cast<std::int32_t>(points.size()));
        if (fresh) points.push_back(cell->vertex(c)->point().point());
        mesh.T(t, c) = entry->second;
      }
      mesh.label.push_back(static_cast<std::uint16_t>(complex_.subdomain_index(cell) - voxel::soft));
    }
    mesh.V.resize(static_cast<Eigen::Index>(points.size()), 3);
    for (std::size_t n = 0; n < points.size(); ++n)
      mesh.V.row(static_cast<Eigen::Index>(n)) << points[n].x(), points[n].y(), points[n].z();
    return mesh;
  }

  const Image& labels_;
  LabelField field_;
  const std::vector<std::uint8_t>& distance_;
  double near_, expected_nodes_;
  const Context& context_;
  Complex complex_;
  std::uint64_t looks_ = 0;
  bool refined_ = false;
};

class CgalMesher : public Mesher {
 public:
  std::string_view name() const override { return "cgal"; }

  TetMesh mesh(const Input& input, const Options& options, const Context& context) const override {
    const std::vector<std::uint8_t> distance = surface_distance(input.labels, context);
    const double allowed = std::min(static_cast<double>(options.max_tets),
                                    static_cast<double>(options.max_nodes) / kNodesPerTet);
    check_budget(allowed);
    double near = choose_near(input.labels, distance, allowed);
    for (;;) {
      TetMesh mesh = Run(input.labels, distance, near, context).mesh();
      if (mesh.T.rows() == 0)
        throw Error(ErrorKind::data, "tets", "CGAL found no tet in the label image",
                    "use finer voxels, or --mesher lattice");
      const double excess =
          std::max(static_cast<double>(mesh.T.rows()) / static_cast<double>(options.max_tets),
                   static_cast<double>(mesh.V.rows()) / static_cast<double>(options.max_nodes));
      if (excess <= 1) {
        context.report(1);
        return mesh;
      }
      near *= 1.05 * std::sqrt(excess);
      context.warn("CGAL made " + std::to_string(mesh.T.rows()) + " tets and " +
                   std::to_string(mesh.V.rows()) + " nodes, more than allowed: again with tets of " +
                   std::to_string(near) + " mm");
    }
  }
};

}  // namespace

std::unique_ptr<Mesher> make_cgal_mesher() {
  return std::make_unique<CgalMesher>();
}

}  // namespace ecorche::tet
