// SPDX-License-Identifier: Apache-2.0
// The bar of Sujar18 figure 7.
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "phantom/phantom.hpp"

namespace ecorche::phantom {

namespace {

using Eigen::Vector3d;

constexpr double kLength = 800, kHalfWidth = 50;  // mm
constexpr double kBoneHalfLength = 80, kBoneHalfWidth = 15;

/// A box as a regular grid of squares, each cut in two, no vertex twice.
SurfaceMesh box_mesh(const Vector3d& lo, const Vector3d& hi, double edge) {
  std::array<int, 3> n{};
  for (int a = 0; a < 3; ++a)
    n[static_cast<std::size_t>(a)] = std::max(1, static_cast<int>(std::lround((hi[a] - lo[a]) / edge)));
  std::map<std::array<int, 3>, std::int32_t> row;
  std::vector<std::array<std::int32_t, 3>> triangles;
  std::vector<Vector3d> points;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [found, fresh] = row.try_emplace(at, static_cast<std::int32_t>(points.size()));
    if (fresh) {
      Vector3d p;
      for (int a = 0; a < 3; ++a)
        p[a] = lo[a] + (hi[a] - lo[a]) * at[static_cast<std::size_t>(a)] / n[static_cast<std::size_t>(a)];
      points.push_back(p);
    }
    return found->second;
  };
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t u = (a + 1) % 3, v = (a + 2) % 3;
    for (const bool far : {false, true}) {
      for (int j = 0; j < n[v]; ++j) {
        for (int i = 0; i < n[u]; ++i) {
          std::array<std::int32_t, 4> q{};
          for (std::size_t c = 0; c < 4; ++c) {
            std::array<int, 3> at{};
            at[a] = far ? n[a] : 0;
            at[u] = i + (c == 1 || c == 2 ? 1 : 0);
            at[v] = j + (c >= 2 ? 1 : 0);
            q[c] = vertex(at);
          }
          if (!far) std::swap(q[1], q[3]);
          if ((i + j) % 2 == 0) {
            triangles.push_back({q[0], q[1], q[2]});
            triangles.push_back({q[0], q[2], q[3]});
          } else {
            triangles.push_back({q[0], q[1], q[3]});
            triangles.push_back({q[1], q[2], q[3]});
          }
        }
      }
    }
  }
  SurfaceMesh mesh;
  mesh.V.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    mesh.V.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  mesh.F.resize(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t i = 0; i < triangles.size(); ++i)
    mesh.F.row(static_cast<Eigen::Index>(i)) << triangles[i][0], triangles[i][1], triangles[i][2];
  return mesh;
}

}  // namespace

Phantom make_bar(Size size, const Context& context) {
  const double edge = size == Size::small ? 25 : size == Size::standard ? 10 : 5;
  Phantom bar;
  bar.patient.name = "bar";
  bar.patient.skin = box_mesh({-kHalfWidth, -kHalfWidth, 0}, {kHalfWidth, kHalfWidth, kLength}, edge);
  bar.patient.skeleton.name = "bar";
  for (int i = 0; i < 4; ++i) {
    const std::string number = std::to_string(i + 1);
    const double middle = 100 + 200.0 * i;
    CaseBone bone{"bone_" + number, "bar_" + number, {}};
    bone.surface = box_mesh({-kBoneHalfWidth, -kBoneHalfWidth, middle - kBoneHalfLength},
                            {kBoneHalfWidth, kBoneHalfWidth, middle + kBoneHalfLength}, edge);
    bar.patient.bones.push_back(std::move(bone));

    Segment segment;
    segment.name = "bar_" + number;
    segment.parent = i - 1;
    segment.joint.name = i == 0 ? "bar_root" : "joint_" + std::to_string(i);
    segment.joint.kind = i == 0 ? JointKind::free : JointKind::ball;
    segment.joint.center = {0, 0, 200.0 * i};
    // Named as in the figure: two ways to bend, and twist about the bar.
    segment.joint.sequence.resize(3);
    segment.joint.sequence[0].name = "bending";
    segment.joint.sequence[1].name = "side_bending";
    segment.joint.sequence[1].axis = 1;
    segment.joint.sequence[2].name = "twist";
    segment.joint.sequence[2].axis = 2;
    bar.patient.skeleton.segments.push_back(std::move(segment));
  }
  bar.truth = bar.patient.skeleton;
  context.report(1);
  return bar;
}

}  // namespace ecorche::phantom
