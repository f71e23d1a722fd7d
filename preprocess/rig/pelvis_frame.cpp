// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/pelvis_frame.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/linear/decompositions.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Of BodyParts3D's man, the Visible Human and ICRP's woman. The second principal axis leans back by 7.0, 9.2
// and 10.6 degrees. The surface is spread along it by 0.753, 0.752 and 0.808 of the spread along the first,
// along the third by 0.481, 0.474 and 0.529, with a skewness of -0.34, -0.27 and -0.56 upwards and of 0.01 to
// the left. Pelves cut so that they pass all bounds lie 8 degrees off at most.
constexpr double kLean = 8.9 * 3.14159265358979323846 / 180;
constexpr double kSecondLeast = 0.72, kSecondMost = 0.86, kThirdLeast = 0.42, kThirdMost = 0.55;
constexpr double kUpSkew = -0.2, kSideSkew = 0.1;
constexpr double kAskew = 0.5;  // cosine

// Of a surface, each part of which counts as its area does, in thirds of triangles.
struct SurfaceSpread {
  Vector3d mean = Vector3d::Zero();
  Matrix3d scatter = Matrix3d::Zero();
  double area = 0;

  template <class Each>
  static void each_triangle(const Case& patient, Each&& each) {
    for (const CaseBone& bone : patient.bones) {
      if (bone.segment != "pelvis") continue;
      const SurfaceMesh& mesh = bone.surface;
      for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
        const Vector3d a = mesh.V.row(mesh.F(f, 0)), b = mesh.V.row(mesh.F(f, 1)),
                       c = mesh.V.row(mesh.F(f, 2));
        each((a + b + c) / 3, (b - a).cross(c - a).norm());
      }
    }
  }

  explicit SurfaceSpread(const Case& patient) {
    each_triangle(patient, [&](const Vector3d& at, double weight) {
      mean += weight * at;
      area += weight;
    });
    if (!(area > 0)) return;
    mean /= area;
    each_triangle(patient, [&](const Vector3d& at, double weight) {
      scatter += weight / area * (at - mean) * (at - mean).transpose();
    });
  }

  double skewness(const Case& patient, const Vector3d& along, double variance) const {
    double sum = 0;
    each_triangle(patient, [&](const Vector3d& at, double weight) {
      sum += weight / area * std::pow(along.dot(at - mean), 3);
    });
    return sum / std::pow(variance, 1.5);
  }
};

}  // namespace

std::optional<Matrix3d> pelvis_frame(const Case& patient) {
  const SurfaceSpread spread(patient);
  if (!(spread.area > 0)) return std::nullopt;
  const linear::SymmetricEigen axes = linear::symmetric_eigen(spread.scatter);
  const double longest = axes.values[2];
  if (!(longest > 0)) return std::nullopt;
  const double second = std::sqrt(axes.values[1] / longest);
  const double third = std::sqrt(std::max(0.0, axes.values[0]) / longest);
  if (!(second >= kSecondLeast && second <= kSecondMost && third >= kThirdLeast && third <= kThirdMost))
    return std::nullopt;
  Vector3d left = axes.vectors.col(2), high = axes.vectors.col(1);
  if (left.x() < 0) left = -left;
  double skew = spread.skewness(patient, high, axes.values[1]);
  if (skew > 0) {
    high = -high;
    skew = -skew;
  }
  if (skew > kUpSkew || std::abs(spread.skewness(patient, left, longest)) > kSideSkew) return std::nullopt;
  const Vector3d behind = high.cross(left);
  Matrix3d frame;
  frame << left, std::cos(kLean) * behind + std::sin(kLean) * high,
      std::cos(kLean) * high - std::sin(kLean) * behind;
  if (frame(0, 0) < kAskew || frame(2, 2) < kAskew) return std::nullopt;
  return frame;
}

}  // namespace ecorche::rig
