// SPDX-License-Identifier: Apache-2.0
#include "bench/meshers/measures.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/geometry/dihedral.hpp"
#include "core/geometry/face_tree.hpp"

namespace ecorche::bench {
namespace {

using Eigen::Vector3d;

std::array<Vector3d, 4> corners(const TetMesh& mesh, Eigen::Index t) {
  std::array<Vector3d, 4> p;
  for (std::size_t c = 0; c < 4; ++c) p[c] = mesh.V.row(mesh.T(t, static_cast<Eigen::Index>(c))).transpose();
  return p;
}

double radius_ratio(const std::array<Vector3d, 4>& p) {
  const Vector3d a = p[1] - p[0], b = p[2] - p[0], c = p[3] - p[0];
  const double det = a.cross(b).dot(c);
  const double area =
      0.5 * (a.cross(b).norm() + b.cross(c).norm() + c.cross(a).norm() + (b - a).cross(c - a).norm());
  const Vector3d centre =
      (a.squaredNorm() * b.cross(c) + b.squaredNorm() * c.cross(a) + c.squaredNorm() * a.cross(b)) /
      (2 * det);
  return 3 * (0.5 * det / area) / centre.norm();
}

double percentile(std::vector<double>& x, double share) {
  if (x.empty()) return 0;
  std::sort(x.begin(), x.end());
  return x[static_cast<std::size_t>(share * static_cast<double>(x.size() - 1))];
}

/// Faces of one tet, or between tets in and out of a label; -1: the whole body.
std::vector<SurfaceMesh> boundaries(const TetMesh& mesh, std::size_t bones) {
  struct Face {
    std::array<std::int32_t, 3> sorted, seen;
    std::uint16_t label;
  };
  static constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  std::vector<Face> faces;
  faces.reserve(static_cast<std::size_t>(mesh.T.size()));
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    for (const auto& f : kFaces) {
      Face face{
          {mesh.T(t, f[0]), mesh.T(t, f[1]), mesh.T(t, f[2])}, {}, mesh.label[static_cast<std::size_t>(t)]};
      face.seen = face.sorted;
      std::sort(face.sorted.begin(), face.sorted.end());
      faces.push_back(face);
    }
  tbb::parallel_sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) {
    return a.sorted != b.sorted ? a.sorted < b.sorted : a.label < b.label;
  });
  std::vector<std::vector<std::array<std::int32_t, 3>>> of(bones + 1);
  const auto keep = [&](const Face& face) {
    if (face.label > 0) of[face.label].push_back(face.seen);
  };
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (f + 1 == faces.size() || faces[f].sorted != faces[f + 1].sorted) {
      of[0].push_back(faces[f].seen);
      keep(faces[f]);
      continue;
    }
    if (faces[f].label != faces[f + 1].label) {
      keep(faces[f]);
      keep(faces[f + 1]);
    }
    ++f;
  }
  std::vector<SurfaceMesh> out(of.size());
  for (std::size_t s = 0; s < of.size(); ++s) {
    out[s].V = mesh.V;
    out[s].F.resize(static_cast<Eigen::Index>(of[s].size()), 3);
    for (std::size_t f = 0; f < of[s].size(); ++f)
      out[s].F.row(static_cast<Eigen::Index>(f)) << of[s][f][0], of[s][f][1], of[s][f][2];
  }
  return out;
}

Vector3d corner(const SurfaceMesh& s, Eigen::Index f, Eigen::Index c) {
  return s.V.row(s.F(f, c)).transpose();
}
Vector3d normal(const SurfaceMesh& s, Eigen::Index f) {
  return (corner(s, f, 1) - corner(s, f, 0)).cross(corner(s, f, 2) - corner(s, f, 0)).normalized();
}

double volume(const SurfaceMesh& s) {
  double six = 0;
  for (Eigen::Index f = 0; f < s.F.rows(); ++f)
    six += corner(s, f, 0).dot(corner(s, f, 1).cross(corner(s, f, 2)));
  return std::abs(six) / 6;
}

struct Sample {
  Vector3d point;
  Eigen::Index face;
};

/// Points at equal steps of area along the triangles, at low-discrepancy places within them.
std::vector<Sample> samples(const SurfaceMesh& s, std::size_t count) {
  std::vector<double> before(static_cast<std::size_t>(s.F.rows()) + 1, 0);
  for (Eigen::Index f = 0; f < s.F.rows(); ++f)
    before[static_cast<std::size_t>(f) + 1] =
        before[static_cast<std::size_t>(f)] +
        (corner(s, f, 1) - corner(s, f, 0)).cross(corner(s, f, 2) - corner(s, f, 0)).norm();
  std::vector<Sample> out;
  std::size_t f = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const double at = (static_cast<double>(n) + 0.5) / static_cast<double>(count) * before.back();
    while (f + 2 < before.size() && before[f + 1] <= at) ++f;
    double u = std::fmod(0.7548776662 * static_cast<double>(n), 1.0),
           v = std::fmod(0.5698402910 * static_cast<double>(n), 1.0);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const auto row = static_cast<Eigen::Index>(f);
    out.push_back({(1 - u - v) * corner(s, row, 0) + u * corner(s, row, 1) + v * corner(s, row, 2), row});
  }
  return out;
}

/// Whether a ball of half a voxel does not fit under the surface there (nearly), from within.
bool thin_at(const SurfaceMesh& surface, const geometry::FaceTree& tree, const Vector3d& p, Eigen::Index face,
             double voxel) {
  const Vector3d n = normal(surface, face);
  return tree.nearest(p - 0.5 * voxel * n, static_cast<std::int32_t>(face)).squared < 0.16 * voxel * voxel;
}

SurfaceFit fit(const SurfaceMesh& input, const SurfaceMesh& made, double voxel, std::size_t count) {
  SurfaceFit out;
  if (input.F.rows() == 0) return out;
  out.there = made.F.rows() > 0;
  if (!out.there) return out;
  const geometry::FaceTree of_input(input), of_made(made);
  struct Found {
    double away;
    bool thin;
  };
  const auto look = [&](const SurfaceMesh& from, bool back) {
    const std::vector<Sample> points = samples(from, count);
    std::vector<Found> found(points.size());
    tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t n) {
      const auto hit = (back ? of_input : of_made).nearest(points[n].point);
      const bool thin = back ? thin_at(input, of_input, hit.point, hit.face, voxel)
                             : thin_at(input, of_input, points[n].point, points[n].face, voxel);
      found[n] = {std::sqrt(hit.squared) / voxel, thin};
    });
    return found;
  };
  const std::vector<Found> there = look(input, false), back = look(made, true);
  std::vector<double> to_mesh, to_input, thin;
  for (const Found& f : there) (f.thin ? thin : to_mesh).push_back(f.away);
  out.thin_share = static_cast<double>(thin.size()) / static_cast<double>(there.size());
  for (const Found& f : back) (f.thin ? thin : to_input).push_back(f.away);
  out.to_mesh_p99 = percentile(to_mesh, 0.99);
  out.to_input_p99 = percentile(to_input, 0.99);
  out.thin_p99 = percentile(thin, 0.99);
  out.volume_error = volume(made) / volume(input) - 1;
  return out;
}

}  // namespace

Shapes shapes(const TetMesh& mesh) {
  Shapes out;
  std::vector<double> least(static_cast<std::size_t>(mesh.T.rows())), greatest(least), ratio(least);
  tbb::parallel_for(std::size_t{0}, least.size(), [&](std::size_t t) {
    const auto p = corners(mesh, static_cast<Eigen::Index>(t));
    const geometry::TetShape shape = geometry::tet_shape(p);
    least[t] = shape.least_deg();
    greatest[t] = shape.greatest_deg();
    ratio[t] = radius_ratio(p);
  });
  if (least.empty()) return out;
  out.greatest_deg = *std::max_element(greatest.begin(), greatest.end());
  out.least_ratio = *std::min_element(ratio.begin(), ratio.end());
  for (const double r : ratio) out.mean_ratio += r / static_cast<double>(ratio.size());
  out.hundredth_deg = percentile(least, 0.01);
  out.least_deg = least.front();
  return out;
}

std::vector<SurfaceFit> fits(const Case& patient, const TetMesh& mesh, double voxel, std::size_t count) {
  const std::vector<SurfaceMesh> made = boundaries(mesh, patient.bones.size());
  std::vector<SurfaceFit> out;
  out.push_back(fit(patient.skin, made[0], voxel, count));
  out.back().name = patient.skin_name;
  for (std::size_t b = 0; b < patient.bones.size(); ++b) {
    out.push_back(fit(patient.bones[b].surface, made[b + 1], voxel, count));
    out.back().name = patient.bones[b].name;
  }
  return out;
}

}  // namespace ecorche::bench
