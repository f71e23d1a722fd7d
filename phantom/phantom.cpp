// SPDX-License-Identifier: Apache-2.0
// Joins landmarks, solids, meshes, scan, skeleton and clips into a case.
#include "phantom/phantom.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "phantom/body.hpp"
#include "phantom/clips.hpp"
#include "phantom/isosurface.hpp"
#include "phantom/simplify.hpp"
#include "phantom/volume.hpp"

namespace ecorche::phantom {

namespace {

/// What a size means. Surfaces get about 1.5 vertices per lattice square of area; the body has 5.3 m^2.
struct Resolution {
  double spacing;  ///< mm, of the lattice where a part is not thin
  double thin;     ///< spacing over the part's thinnest radius, at most
  double voxel;    ///< mm
  bool simplify;   ///< down to Part::small_vertices
};

Resolution resolution_of(Size size) {
  switch (size) {
    case Size::small:
      return {10, 1.25, 6, true};
    case Size::standard:
      return {7.8, 1.25, 4, false};
    case Size::paper:
      break;
  }
  return {2.4, 1, 2.5, false};
}

SurfaceMesh mirror_image(const SurfaceMesh& mesh) {
  SurfaceMesh image = mesh;
  image.V.col(0) = -image.V.col(0);
  image.F.col(1).swap(image.F.col(2));
  return image;
}

/// Back onto the surface after simplification. Chords of a convex surface lie inside it, so that bones and
/// tissues only shrink; the skin's vertices stand out a little instead, so that its chords do not cut into
/// what it covers.
constexpr double kSkinAllowance = 2;  // mm

void put_on(const Shape& shape, SurfaceMesh& mesh) {
  for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) {
    Vec p = mesh.V.row(v).transpose();
    for (int i = 0; i < 3; ++i) {
      const Shape::Sample at = shape.sample(p);
      p -= std::clamp(at.distance, -1.5, 1.5) * at.normal;
    }
    mesh.V.row(v) = p.transpose();
  }
}

Box bounds_of(const SurfaceMesh& mesh) {
  return {mesh.V.colwise().minCoeff().transpose(), mesh.V.colwise().maxCoeff().transpose()};
}

std::vector<SurfaceMesh> make_meshes(const std::vector<Part>& parts, const Resolution& resolution,
                                     const Context& context) {
  std::vector<SurfaceMesh> meshes(parts.size());
  // Whole parts side by side where they are many and small; the lattice's own loops keep all cores busy
  // otherwise.
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
    const Part& part = parts[i];
    if (part.mirror_of >= 0 || context.stop.stop_requested()) return;
    const Context quiet = context.quiet();
    meshes[i] = isosurface(part.shape, std::min(resolution.spacing, resolution.thin * part.detail), quiet);
    if (!resolution.simplify) return;
    meshes[i] = simplify(meshes[i], part.small_vertices);
    put_on(part.group == Group::skin ? grow(part.shape, kSkinAllowance) : part.shape, meshes[i]);
  });
  context.check_stop();
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].mirror_of >= 0)
      meshes[i] = mirror_image(meshes[static_cast<std::size_t>(parts[i].mirror_of)]);
  }
  return meshes;
}

void scale(Skeleton& skeleton, double by) {
  for (Segment& segment : skeleton.segments) segment.joint.center *= by;
}

void scale(Image& image, double by) {
  for (double& mm : image.grid.origin) mm *= by;
  for (double& mm : image.grid.spacing) mm *= by;
}

/// Taller or smaller as a whole, so that no angle changes.
void scale(Case& patient, double by) {
  if (by == 1) return;  // the plain phantom keeps its bytes
  scale(patient.skeleton, by);
  patient.skin.V *= by;
  for (CaseBone& bone : patient.bones) bone.surface.V *= by;
  for (CaseTissue& tissue : patient.tissues) tissue.surface.V *= by;
  for (CaseVolume& volume : patient.volumes) scale(volume.image, by);
  scale(patient.labels->image, by);
}

}  // namespace

Phantom make(Size size, std::uint64_t seed, const Context& context, double voxel_mm, Variety variety) {
  const Resolution resolution = resolution_of(size);
  const Proportions of = variety == Variety::population ? varied_proportions(seed) : plain_proportions(seed);
  const Body body = make_body(of);
  const Landmarks& at = body.at;
  const std::vector<Part>& parts = body.parts;
  Phantom phantom;
  phantom.truth = make_skeleton(at, false);
  scale(phantom.truth, of.height);
  phantom.clips = {make_walk(phantom.truth), make_bend(phantom.truth)};

  Case& patient = phantom.patient;
  patient.name = "phantom";
  patient.skeleton = make_skeleton(at, true);
  std::vector<SurfaceMesh> meshes = make_meshes(parts, resolution, context);
  context.report(0.4);
  patient.skin = make_meshes({body.skin}, resolution, context).front();
  context.report(0.7);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].group == Group::bone) {
      patient.bones.push_back({parts[i].name, parts[i].segment, std::move(meshes[i])});
    } else {
      patient.tissues.push_back({parts[i].name, parts[i].group, std::move(meshes[i])});
    }
  }
  Context scan_context = context;
  scan_context.progress = [&](double done) { context.report(0.7 + 0.3 * done); };
  // The voxels are those of the scan, whose body is scaled below.
  const double voxel = (voxel_mm > 0 ? voxel_mm : resolution.voxel) / of.height;
  Scan scan = make_scan(body.skin, parts, bounds_of(patient.skin), voxel, seed, scan_context);
  patient.volumes = {std::move(scan.ct), std::move(scan.ct_noisy)};
  patient.labels = std::move(scan.labels);
  scale(patient, of.height);
  context.report(1);
  return phantom;
}

}  // namespace ecorche::phantom
