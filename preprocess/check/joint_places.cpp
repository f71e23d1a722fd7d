// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/joint_places.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/linear/decompositions.hpp"

namespace ecorche::check {
namespace {

constexpr Eigen::Index kProbes = 400;
constexpr double kLong = 9;  // a shaft's variance, in variances across it: three times as long as wide

SurfaceMesh merged(const Case& patient, const std::string& segment) {
  SurfaceMesh out;
  Eigen::Index vertices = 0, faces = 0;
  const auto each = [&](auto&& visit) {
    for (const CaseBone& bone : patient.bones) {
      if (bone.segment == segment) visit(bone.surface);
    }
  };
  each([&](const SurfaceMesh& mesh) {
    vertices += mesh.V.rows();
    faces += mesh.F.rows();
  });
  out.V.resize(vertices, 3);
  out.F.resize(faces, 3);
  vertices = faces = 0;
  each([&](const SurfaceMesh& mesh) {
    out.V.middleRows(vertices, mesh.V.rows()) = mesh.V;
    out.F.middleRows(faces, mesh.F.rows()) = (mesh.F.array() + static_cast<std::int32_t>(vertices)).matrix();
    vertices += mesh.V.rows();
    faces += mesh.F.rows();
  });
  return out;
}

}  // namespace

double SegmentBones::distance(const Eigen::Vector3d& p) const {
  return tree ? std::sqrt(tree->nearest(p).squared) : std::numeric_limits<double>::infinity();
}

std::vector<SegmentBones> bones_of(const Case& patient, const Skeleton& skeleton) {
  std::vector<SegmentBones> out(skeleton.segments.size());
  tbb::parallel_for(std::size_t{0}, out.size(), [&](std::size_t row) {
    SegmentBones& bones = out[row];
    bones.surface = merged(patient, skeleton.segments[row].name);
    const Points& V = bones.surface.V;
    if (bones.surface.F.rows() > 0) {
      bones.tree = std::make_unique<geometry::FaceTree>(bones.surface);
      bones.box = {V.colwise().minCoeff().transpose(), V.colwise().maxCoeff().transpose()};
      const Points from = V.rowwise() - V.colwise().mean();
      const linear::SymmetricEigen axes = linear::symmetric_eigen(from.transpose() * from);
      if (axes.values[2] > kLong * axes.values[1]) bones.shaft = axes.vectors.col(2);
    }
  });
  return out;
}

std::optional<Gap> gap_between(const SegmentBones& a, const SegmentBones& b) {
  if (!a.tree || !b.tree) return std::nullopt;
  const Eigen::Index step = std::max<Eigen::Index>(1, a.surface.V.rows() / kProbes);
  Gap best{std::numeric_limits<double>::infinity(), Eigen::Vector3d::Zero()};
  std::int32_t hint = -1;
  for (Eigen::Index v = 0; v < a.surface.V.rows(); v += step) {
    const Eigen::Vector3d p = a.surface.V.row(v).transpose();
    const geometry::FaceTree::Hit hit = b.tree->nearest(p, hint);
    hint = hit.face;
    if (const double away = std::sqrt(hit.squared); away < best.mm) best = {away, 0.5 * (p + hit.point)};
  }
  return best;
}

Place place_of(const Skeleton& skeleton, const std::vector<SegmentBones>& bones, std::size_t row,
               const Eigen::Vector3d& at) {
  const int parent = skeleton.segments[row].parent;
  Place out;
  out.own = bones[row].distance(at);
  out.parent = out.own;
  out.length = bones[row].length();
  if (parent < 0) return out;
  const SegmentBones& other = bones[static_cast<std::size_t>(parent)];
  out.parent = other.distance(at);
  out.length = std::max(out.length, other.length());
  return out;
}

}  // namespace ecorche::check
