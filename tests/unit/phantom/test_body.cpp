// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/unit/phantom/mesh_checks.hpp"
#include "tests/unit/phantom/small_phantom.hpp"

namespace ecorche::phantom {
namespace {

const SurfaceMesh& surface_of(const std::string& name) {
  const Case& patient = small_phantom().patient;
  for (const CaseBone& bone : patient.bones) {
    if (bone.name == name) return bone.surface;
  }
  for (const CaseTissue& tissue : patient.tissues) {
    if (tissue.name == name) return tissue.surface;
  }
  throw Error(ErrorKind::internal, "test", "no " + name, "");
}

TEST(Body, BonesOfDifferentSegmentsKeepTheirGap) {
  for (const Part& a : body().parts) {
    if (a.group != Group::bone) continue;
    double nearest = 1e9;
    std::string to;
    const SurfaceMesh& mesh = surface_of(a.name);
    for (const Part& b : body().parts) {
      if (b.group != Group::bone || b.segment == a.segment ||
          b.shape.box().grown(5).distance(mesh.V.row(0).transpose()) > 1500)
        continue;
      for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) {
        const double d = b.shape.distance(mesh.V.row(v).transpose());
        if (d < nearest) nearest = d, to = b.name;
      }
    }
    EXPECT_GT(nearest, 3.0) << a.name << " to " << to;
  }
}

TEST(Body, TissuesLieInsideTheSkinAndOutsideTheBones) {
  const Shape& skin = body().skin.shape;
  std::vector<Shape> bones;
  for (const Part& part : body().parts) {
    if (part.group == Group::bone) bones.push_back(part.shape);
  }
  for (const Part& part : body().parts) {
    const SurfaceMesh& mesh = surface_of(part.name);
    double shallowest = -1e9, nearest = 1e9;
    Vec shallow_at = Vec::Zero(), near_at = Vec::Zero();
    for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) {
      const Vec p = mesh.V.row(v).transpose();
      if (const double d = skin.distance(p); d > shallowest) shallowest = d, shallow_at = p;
      if (part.group == Group::bone) continue;
      for (const Shape& bone : bones) {
        if (const double d = bone.distance(p); d < nearest) nearest = d, near_at = p;
      }
    }
    EXPECT_LT(shallowest, -2.9) << part.name << " at " << shallow_at.transpose();
    EXPECT_GT(nearest, 1.9) << part.name << " at " << near_at.transpose();
  }
}

TEST(Body, NothingReachesIntoTheJoints) {
  const Landmarks& at = body().at;
  const Shape joints[] = {
      sphere(at.hip, kFemoralHead + 10), sphere(at.shoulder, kHumeralHead + 8),
      cylinder(at.knee - 30 * at.knee_axis, at.knee + 30 * at.knee_axis, kKneeRadius + 9, 0),
      cylinder(at.elbow - 22 * at.elbow_axis, at.elbow + 22 * at.elbow_axis, kElbowRadius + 7, 0)};
  for (const Part& part : body().parts) {
    if (part.group == Group::bone) continue;
    const SurfaceMesh& mesh = surface_of(part.name);
    for (const Shape& joint : joints) {
      for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) {
        const Vec p(std::abs(mesh.V(v, 0)), mesh.V(v, 1), mesh.V(v, 2));
        EXPECT_GT(joint.distance(p), 0) << part.name;
      }
    }
  }
}

TEST(Body, LimbsTouchNeitherTrunkNorEachOther) {
  const Shape& skin = body().skin.shape;
  const Landmarks& at = body().at;
  for (double z = at.knee.z() - 300; z < 780; z += 10)
    EXPECT_GT(skin.distance({0, 0, z}), 10) << "between the legs at " << z;
  // Half way from the hand to the thigh, and from the elbow to the waist.
  EXPECT_GT(skin.distance({(at.wrist.x() + 175) / 2, at.wrist.y(), at.wrist.z()}), 8);
  EXPECT_GT(skin.distance({182, 0, at.elbow.z()}), 8);
}

TEST(Body, AnySeedGivesABody) {
  for (std::uint64_t seed = 10; seed < 16; ++seed) {
    const Body other = make_body(seed);
    EXPECT_LE(other.skin.shape.box().hi.z(), 1760);
    EXPECT_EQ(other.parts.size(), body().parts.size());
    // The floor of bones: nothing outside the skin at the centres of all joints.
    for (const Vec& p : {other.at.knee, other.at.ankle, other.at.wrist, other.at.elbow})
      EXPECT_LT(other.skin.shape.distance(p), -8);
  }
}

}  // namespace
}  // namespace ecorche::phantom
