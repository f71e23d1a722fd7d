// SPDX-License-Identifier: Apache-2.0
// The phantom's true centres and axes, found again: on regions that travelled with their vertices through a
// smooth registration, noise, corruption and loss; and by the human template on the clean bones.
#include <gtest/gtest.h>

#include <numbers>
#include <random>
#include <set>

#include "io/case/case_rules.hpp"
#include "io/case/skeleton_file.hpp"
#include "phantom/body.hpp"
#include "phantom/bones.hpp"
#include "phantom/isosurface.hpp"
#include "preprocess/rig/fit_rig.hpp"
#include "preprocess/rig/joint_sources.hpp"
#include "tests/unit/rig/axis_angle.hpp"
#include "tests/unit/rig/balls.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Vector3d;
using phantom::Landmarks;

/// A joint of the phantom: its bone, and the true sphere (no axis) or cylinder on it.
struct Truth {
  std::string name, bone;
  Vector3d centre, axis;
  double radius, half_length;
};

struct Limb {
  Landmarks at = phantom::make_landmarks(3);
  std::map<std::string, SurfaceMesh> bones;
  std::vector<Truth> truths;
  Limb() {
    bones["femur"] = phantom::isosurface(phantom::femur_bone(at), 3, {});
    bones["humerus"] = phantom::isosurface(phantom::humerus_bone(at), 2, {});
    bones["foot"] = phantom::isosurface(phantom::foot_bone(at), 2, {});
    const Vector3d none = Vector3d::Zero();
    truths = {{"hip", "femur", at.hip, none, phantom::kFemoralHead, 0},
              {"shoulder", "humerus", at.shoulder, none, phantom::kHumeralHead, 0},
              {"knee", "femur", at.knee, at.knee_axis, phantom::kKneeRadius, 31},
              {"elbow", "humerus", at.elbow - at.elbow_axis, at.elbow_axis, phantom::kElbowRadius, 20},
              {"ankle", "foot", at.ankle, at.ankle_axis, phantom::kAnkleRadius, 11}};
  }
  /// Rows of the bone that lie on the joint's true surface.
  std::vector<Eigen::Index> region(const Truth& truth) const {
    const Points& V = bones.at(truth.bone).V;
    std::vector<Eigen::Index> rows;
    for (Eigen::Index v = 0; v < V.rows(); ++v) {
      const Vector3d from = V.row(v).transpose() - truth.centre;
      const double along = from.dot(truth.axis), away = (from - along * truth.axis).norm();
      if (std::abs(away - truth.radius) < 0.4 && std::abs(along) <= truth.half_length) rows.push_back(v);
    }
    return rows;
  }
};

const Limb& limb() {
  static const Limb made;
  return made;
}

/// As a registration bends space: 6 mm, over lengths of a limb.
Vector3d warped(const Vector3d& p, std::uint32_t seed) {
  const double turn = 0.7 * seed;
  const Vector3d wave(std::sin(p.z() / 160 + turn), std::sin(p.x() / 140 - turn),
                      std::sin(p.y() / 150 + 2 * turn));
  return p + 6 * wave + 0.03 * Vector3d(p.x(), 0, -p.z());
}

TEST(Truth, centres_within_two_millimetres_and_axes_within_two_degrees_on_spoilt_registered_regions) {
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    Case patient;
    patient.name = "limb";
    patient.skeleton.name = "limb";
    Segment root;
    root.name = root.joint.name = "root";
    root.joint.sequence = {{.name = "x", .axis = 0}, {.name = "y", .axis = 1}, {.name = "z", .axis = 2}};
    patient.skeleton.segments = {root};
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 1 / std::sqrt(3.0));  // 1 mm rms
    std::uniform_real_distribution<double> share(0, 1), far(-15, 15);
    for (const auto& [name, surface] : limb().bones) {
      patient.bones.push_back({name, name, surface});
      Points& V = patient.bones.back().surface.V;
      for (Eigen::Index v = 0; v < V.rows(); ++v) {
        const Vector3d to = warped(V.row(v).transpose(), seed);
        const bool corrupted = share(random) < 0.2;
        for (int c = 0; c < 3; ++c) V(v, c) = to[c] + noise(random) + (corrupted ? far(random) : 0);
      }
    }
    for (const Truth& truth : limb().truths) {
      const auto bone = std::find_if(patient.bones.begin(), patient.bones.end(),
                                     [&](const CaseBone& b) { return b.name == truth.bone; });
      Region region;
      region.name = truth.name;
      region.bone = truth.bone;
      std::vector<Eigen::Index> rows;
      for (const Eigen::Index row : limb().region(truth)) {
        if (share(random) >= 0.1) rows.push_back(row);
      }
      ASSERT_GT(rows.size(), 100U) << truth.name;
      region.points.resize(static_cast<Eigen::Index>(rows.size()), 3);
      for (std::size_t i = 0; i < rows.size(); ++i)
        region.points.row(static_cast<Eigen::Index>(i)) = bone->surface.V.row(rows[i]);
      patient.regions.push_back(region);
      Segment segment = root;
      segment.name = segment.joint.name = truth.name;
      segment.parent = 0;
      JointRule rule;
      rule.center.rule = truth.half_length > 0 ? CenterRule::cylinder_fit : CenterRule::sphere_fit;
      rule.center.on.region = truth.name;
      if (truth.half_length > 0) {
        DirectionSource axis, up;
        axis.kind = DirectionSource::Kind::fit;
        axis.from = rule.center;
        axis.direction = truth.axis;
        up.direction = Vector3d::UnitZ();
        rule.axes = {{0, axis}, {2, up}};
      }
      segment.joint.rule = rule.center.rule;
      segment.joint.how = std::make_shared<const JointRule>(rule);
      patient.skeleton.segments.push_back(segment);
    }
    for (CaseBone& bone : patient.bones) bone.segment = "root";
    for (std::size_t s = 1; s < patient.skeleton.segments.size(); ++s)
      patient.bones.push_back(
          {"marker_" + std::to_string(s), patient.skeleton.segments[s].name, patient.bones[0].surface});
    const Rig rig = fit(patient, {});
    for (std::size_t i = 0; i < limb().truths.size(); ++i) {
      const Truth& truth = limb().truths[i];
      const Joint& joint = rig.skeleton.segments[i + 1].joint;
      EXPECT_LT((joint.center - warped(truth.centre, seed)).norm(), 2) << truth.name << " seed " << seed;
      if (truth.half_length > 0) {
        const Vector3d end = truth.half_length * truth.axis;
        const Vector3d axis = warped(truth.centre + end, seed) - warped(truth.centre - end, seed);
        EXPECT_LT(degrees(joint.axes.col(0), axis), 2) << truth.name << " seed " << seed;
      }
      EXPECT_GT(rig.fits[i + 1].confidence, 0.5) << truth.name;
      EXPECT_LT(rig.fits[i + 1].inlier_share, 0.97) << truth.name;
    }
  }
}

TEST(Truth, the_human_template_finds_the_phantoms_joints_from_its_bones_alone) {
  const Landmarks at = phantom::make_landmarks(3);
  Case patient;
  patient.name = "phantom";
  io::PlacedSkeleton human = io::parse_skeleton(
      io::yaml::Value::parse(io::skeleton_template("human").value(), "human.yaml"), io::Frame{});
  patient.skeleton = human.skeleton;
  ASSERT_EQ(patient.skeleton.segments.size(), 22U);
  for (const phantom::Part& part : phantom::make_bones(at)) {
    const std::string segment = part.name == "mandible" ? "jaw" : part.segment;
    if (part.mirror_of < 0) {
      patient.bones.push_back({part.name, segment, phantom::isosurface(part.shape, 4, {})});
      continue;
    }
    SurfaceMesh mirror = patient.bones.at(static_cast<std::size_t>(part.mirror_of)).surface;
    mirror.V.col(0) = -mirror.V.col(0);
    mirror.F.col(1).swap(mirror.F.col(2));
    patient.bones.push_back({part.name, segment, mirror});
  }
  io::place_regions({}, human.regions, patient);
  const Rig rig = fit(patient, {});
  ASSERT_EQ(rig.skeleton.segments.size(), 22U);
  for (const double side : {1.0, -1.0}) {
    const std::string end = side > 0 ? "_left" : "_right";
    const auto mirrored = [&](const Vector3d& p) -> Vector3d { return {side * p.x(), p.y(), p.z()}; };
    const auto joint = [&](const std::string& name) -> const Joint& {
      return rig.skeleton.segments[static_cast<std::size_t>(rig.skeleton.find_joint(name + end))].joint;
    };
    EXPECT_LT((joint("hip").center - mirrored(at.hip)).norm(), 2);
    EXPECT_LT((joint("shoulder").center - mirrored(at.shoulder)).norm(), 2);
    EXPECT_LT((joint("knee").center - mirrored(at.knee)).norm(), 4);
    EXPECT_LT((joint("knee").center - mirrored(at.knee)).cross(mirrored(at.knee_axis)).norm(), 2);
    EXPECT_LT(degrees(joint("knee").axes.col(0), mirrored(at.knee_axis)), 2);
    EXPECT_LT((joint("elbow").center - mirrored(at.elbow)).cross(mirrored(at.elbow_axis)).norm(), 2);
    EXPECT_LT(degrees(joint("elbow").axes.col(0), mirrored(at.elbow_axis)), 2);
    EXPECT_LT((joint("ankle").center - mirrored(at.ankle)).cross(mirrored(at.ankle_axis)).norm(), 2);
    // What the phantom's own skeleton says of the scan: the elbow is bent by 17 degrees.
    EXPECT_NEAR(joint("elbow").sequence[0].rest, at.elbow_flexion, 0.05);
    const Vector3d thigh = (mirrored(at.hip) - mirrored(at.knee)).normalized();
    EXPECT_LT(degrees(joint("hip").axes.col(2), thigh), 1);
  }
}

// The left limbs with their neighbours, as a registration leaves them: bent, with noise, a fifth of the
// vertices anywhere, a tenth of them gone. Nobody marked a region: the human template finds its own.
SurfaceMesh spoilt(const SurfaceMesh& bone, std::uint32_t seed, std::mt19937& random) {
  std::normal_distribution<double> noise(0, 1 / std::sqrt(3.0));
  std::uniform_real_distribution<double> share(0, 1), far(-15, 15);
  std::vector<bool> gone;
  SurfaceMesh out = bone;
  for (Eigen::Index v = 0; v < out.V.rows(); ++v) {
    const Vector3d to = warped(bone.V.row(v).transpose(), seed);
    const bool corrupted = share(random) < 0.2;
    for (int c = 0; c < 3; ++c) out.V(v, c) = to[c] + noise(random) + (corrupted ? far(random) : 0);
    gone.push_back(share(random) < 0.1);
  }
  std::vector<Eigen::RowVector3i> faces;
  for (Eigen::Index f = 0; f < out.F.rows(); ++f) {
    bool whole = true;
    for (int c = 0; c < 3; ++c) whole &= !gone[static_cast<std::size_t>(out.F(f, c))];
    if (whole) faces.push_back(out.F.row(f));
  }
  std::vector<Eigen::Index> row(gone.size(), -1);
  Eigen::Index kept = 0;
  for (std::size_t v = 0; v < gone.size(); ++v) {
    if (gone[v]) continue;
    row[v] = kept;
    out.V.row(kept++) = out.V.row(static_cast<Eigen::Index>(v)).eval();
  }
  out.V.conservativeResize(kept, 3);
  out.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (int c = 0; c < 3; ++c)
      out.F(static_cast<Eigen::Index>(f), c) =
          static_cast<std::int32_t>(row[static_cast<std::size_t>(faces[f][c])]);
  }
  return out;
}

TEST(Truth, the_human_template_finds_them_by_itself_on_spoilt_bones) {
  const Landmarks at = phantom::make_landmarks(3);
  const std::set<std::string> limbs{"pelvis",      "thigh_left",     "shank_left",   "foot_left",
                                    "girdle_left", "upper_arm_left", "forearm_left", "hand_left"};
  std::vector<CaseBone> clean;
  for (const phantom::Part& part : phantom::make_bones(at)) {
    const std::string segment = part.segment == "shoulder_girdle_left" ? "girdle_left" : part.segment;
    if (part.mirror_of < 0 && limbs.contains(segment))
      clean.push_back({part.name, segment, phantom::isosurface(part.shape, 3, {})});
  }
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    Case patient;
    patient.name = "limbs";
    io::PlacedSkeleton human = io::parse_skeleton(
        io::yaml::Value::parse(io::skeleton_template("human").value(), "human.yaml"), io::Frame{});
    patient.skeleton = human.skeleton;
    std::mt19937 random(seed);
    for (const CaseBone& bone : clean) {
      patient.bones.push_back(bone);
      patient.bones.back().surface = spoilt(bone.surface, seed, random);
    }
    io::place_regions({}, human.regions, patient);
    const Rig rig = fit(patient, {});
    const auto check = [&](const std::string& name, const Vector3d& centre, const Vector3d& axis,
                           double half) {
      const auto row = static_cast<std::size_t>(rig.skeleton.find_joint(name));
      const Joint& joint = rig.skeleton.segments[row].joint;
      const std::string said = name + " seed " + std::to_string(seed) + " " +
                               std::string(center_rule_name(rig.fits[row].rule)) + " confidence " +
                               std::to_string(rig.fits[row].confidence);
      if (half == 0) {
        EXPECT_LT((joint.center - warped(centre, seed)).norm(), 2) << said;
        return;
      }
      const Vector3d to =
          (warped(centre + half * axis, seed) - warped(centre - half * axis, seed)).normalized();
      EXPECT_LT((joint.center - warped(centre, seed)).cross(to).norm(), 2) << said;
      EXPECT_LT(degrees(joint.axes.col(0), to), 2) << said;
    };
    check("hip_left", at.hip, {}, 0);
    check("shoulder_left", at.shoulder, {}, 0);
    check("knee_left", at.knee, at.knee_axis, 31);
    check("elbow_left", at.elbow, at.elbow_axis, 20);
    // The ankle's drum is small, and what faces the shank too torn: its mean stands in for it, and is warned
    // of.
    const auto ankle = static_cast<std::size_t>(rig.skeleton.find_joint("ankle_left"));
    EXPECT_LT(rig.fits[ankle].confidence, JointSources::least_confidence);
    EXPECT_LT((rig.skeleton.segments[ankle].joint.center - warped(at.ankle, seed)).norm(), 10);
  }
}

// A ball for a bone, anywhere: no template refuses a body, however it lies and whatever it lacks.
TEST(Truth, every_template_finds_joints_on_whatever_bones_there_are) {
  for (const char* name : {"human", "hand", "knee", "quadruped"}) {
    for (const std::uint32_t seed : {1U, 2U, 3U, 4U}) {
      io::PlacedSkeleton placed =
          io::parse_skeleton(io::yaml::Value::parse(io::skeleton_template(name).value(), name), io::Frame{});
      Case patient;
      patient.name = name;
      patient.skeleton = placed.skeleton;
      std::mt19937 random(seed);
      std::uniform_real_distribution<double> share(0, 1), place(-300, 300);
      for (const Segment& segment : placed.skeleton.segments) {
        if (seed > 1 && share(random) < 0.25) continue;
        patient.bones.push_back({segment.name + "_bone", segment.name,
                                 test::ball({place(random), place(random), place(random)}, 20, 8)});
      }
      io::place_regions({}, placed.regions, patient);
      const Rig rig = fit(patient, {});
      for (std::size_t row = 0; row < rig.fits.size(); ++row) {
        const Joint& joint = rig.skeleton.segments[row].joint;
        EXPECT_TRUE(joint.center.allFinite() && joint.axes.allFinite()) << name << " " << joint.name;
        EXPECT_LT((joint.axes.transpose() * joint.axes - Eigen::Matrix3d::Identity()).norm(), 1e-9);
        EXPECT_NEAR(joint.axes.determinant(), 1, 1e-9);
        for (const AngleAxis& angle : joint.sequence) EXPECT_TRUE(std::isfinite(angle.rest)) << joint.name;
      }
    }
  }
}

}  // namespace
}  // namespace ecorche::rig
