// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/unit/phantom/mesh_checks.hpp"
#include "tests/unit/phantom/small_phantom.hpp"

namespace ecorche::phantom {
namespace {

template <class F>
void for_each_surface(const Case& patient, F&& f) {
  f("skin", patient.skin);
  for (const CaseBone& bone : patient.bones) f(bone.name, bone.surface);
  for (const CaseTissue& tissue : patient.tissues) f(tissue.name, tissue.surface);
}

TEST(SmallPhantom, EverySurfaceIsOneSolid) {
  for_each_surface(small_phantom().patient, [](const std::string& name, const SurfaceMesh& mesh) {
    expect_solid(mesh, name);
    EXPECT_EQ(components(mesh), 1) << name;
  });
}

TEST(SmallPhantom, TheCoarseSkinStillCoversEverything) {
  const Case& patient = small_phantom().patient;
  for_each_surface(patient, [&](const std::string& name, const SurfaceMesh& mesh) {
    if (name == "skin") return;
    for (Eigen::Index v = 0; v < mesh.V.rows(); v += 3) {
      EXPECT_GT(winding(patient.skin, mesh.V.row(v).transpose()), 0.5) << name << " at " << mesh.V.row(v);
    }
  });
}

TEST(SmallPhantom, IsSmallAndComplete) {
  const Case& patient = small_phantom().patient;
  Eigen::Index vertices = 0;
  for_each_surface(patient, [&](const std::string&, const SurfaceMesh& mesh) { vertices += mesh.V.rows(); });
  std::printf("%ld vertices in all, %zu bones, %zu tissues\n", static_cast<long>(vertices),
              patient.bones.size(), patient.tissues.size());
  EXPECT_LT(vertices, 10000);
  const auto count = [&](Group group) {
    return std::count_if(patient.tissues.begin(), patient.tissues.end(),
                         [&](const CaseTissue& tissue) { return tissue.group == group; });
  };
  EXPECT_GE(count(Group::muscle), 24);
  EXPECT_GE(count(Group::organ), 8);
  EXPECT_GE(count(Group::vessel), 2);
  EXPECT_EQ(patient.skeleton.segments.size(), 21);
}

TEST(SmallPhantom, FitsItsImage) {
  const SurfaceMesh& skin = small_phantom().patient.skin;
  const Eigen::RowVector3d size = skin.V.colwise().maxCoeff() - skin.V.colwise().minCoeff();
  EXPECT_LT(size.x(), 625);
  EXPECT_LT(size.y(), 320);
  EXPECT_LT(size.z(), 1750);
  EXPECT_GT(size.z(), 1700);
}

TEST(SmallPhantom, EveryBoneHasAnOwner) {
  const Case& patient = small_phantom().patient;
  std::set<std::string> owners;
  for (const CaseBone& bone : patient.bones) {
    EXPECT_GE(patient.skeleton.find_segment(bone.segment), 0) << bone.name;
    owners.insert(bone.segment);
  }
  EXPECT_EQ(owners.size(), patient.skeleton.segments.size());
}

TEST(SmallPhantom, HeadsAreTrueSpheres) {
  // A least-squares sphere through the vertices that face the socket.
  const auto fit = [](const SurfaceMesh& bone, const Vec& centre, double radius, const Vec& towards) {
    Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
    Eigen::Vector4d b = Eigen::Vector4d::Zero();
    int points = 0;
    for (Eigen::Index v = 0; v < bone.V.rows(); ++v) {
      const Vec p = bone.V.row(v).transpose() - centre;
      if (p.norm() > radius + 2 || p.normalized().dot(towards) < 0.1) continue;
      const Eigen::Vector4d row(2 * p.x(), 2 * p.y(), 2 * p.z(), 1);
      A += row * row.transpose();
      b += p.squaredNorm() * row;
      ++points;
    }
    EXPECT_GE(points, 8);
    const Eigen::Vector4d x = A.ldlt().solve(b);
    EXPECT_LT(x.head<3>().norm(), 0.05);
    EXPECT_NEAR(std::sqrt(x[3] + x.head<3>().squaredNorm()), radius, 0.05);
  };
  const Case& patient = small_phantom().patient;
  const Skeleton& truth = small_phantom().truth;
  for (const CaseBone& bone : patient.bones) {
    const double side = bone.name.ends_with("_left") ? 1 : -1;
    const auto centre = [&](const char* joint) {
      const int row = truth.find_joint(joint + std::string(side > 0 ? "_left" : "_right"));
      return truth.segments[static_cast<std::size_t>(row)].joint.center;
    };
    if (bone.name.starts_with("femur"))
      fit(bone.surface, centre("hip"), kFemoralHead, Vec(-side, 0, 0.4).normalized());
    if (bone.name.starts_with("humerus"))
      fit(bone.surface, centre("shoulder"), kHumeralHead, Vec(-side, 0.2, 0.4).normalized());
  }
}

}  // namespace
}  // namespace ecorche::phantom
