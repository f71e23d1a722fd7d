// SPDX-License-Identifier: Apache-2.0
// A spine by vertebra: who follows whom, and by how much.
#include "core/values/spine.hpp"

#include <gtest/gtest.h>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include <map>

#include "core/values/degrees.hpp"
#include "io/case/case_rules.hpp"
#include "io/case/skeleton_file.hpp"

namespace ecorche::spine {
namespace {

using Eigen::Quaterniond;

Skeleton human() {
  return io::parse_skeleton(io::yaml::Value::parse(io::skeleton_template("human").value(), "human.yaml"),
                            io::Frame{})
      .skeleton;
}

std::set<std::string> all() {
  std::set<std::string> out{"thorax"};
  for (const Level& level : levels()) out.insert(std::string(level.segment));
  return out;
}

const Segment& at(const Skeleton& skeleton, const std::string& segment) {
  return skeleton.segments.at(static_cast<std::size_t>(skeleton.find_segment(segment)));
}

std::string parent(const Skeleton& skeleton, const std::string& segment) {
  return skeleton.segments.at(static_cast<std::size_t>(at(skeleton, segment).parent)).name;
}

// By leading joint and angle, all that follow it.
std::map<std::string, double> shares(const Skeleton& skeleton) {
  std::map<std::string, double> out;
  for (const Segment& segment : skeleton.segments) {
    if (find_level(segment.name) == nullptr && segment.name != "thorax") continue;
    for (const Coupling& c : segment.joint.coupled) {
      EXPECT_EQ(c.angle, c.drives);
      out[c.joint + " " + c.angle] += c.ratio;
    }
  }
  return out;
}

void expect_whole_shares(const Skeleton& skeleton, std::size_t leaders) {
  const std::map<std::string, double> sums = shares(skeleton);
  EXPECT_EQ(sums.size(), 3 * leaders);
  for (const auto& [angle, sum] : sums) EXPECT_NEAR(sum, 1, 1e-12) << angle;
}

double share(const Skeleton& skeleton, const std::string& segment, std::size_t angle) {
  return at(skeleton, segment).joint.coupled.at(angle).ratio;
}

// A rig whose joints lie over each other, `human`'s own frames.
Rig rig_of(Skeleton skeleton) {
  Rig rig;
  rig.skeleton = std::move(skeleton);
  for (std::size_t s = 0; s < rig.skeleton.segments.size(); ++s) {
    Joint& joint = rig.skeleton.segments[s].joint;
    joint.center = {0, 0, 20.0 * static_cast<double>(s)};
    rig.fits.push_back({.joint = joint.name});
  }
  return rig;
}

TEST(Spine, EachLevelTakesItsShareOfOneJointOfHuman) {
  const Skeleton split_ = split(human(), all(), Ribs::cage);
  EXPECT_EQ(split_.segments.size(), 22U - 2 + 4 + 24);
  expect_whole_shares(split_, 4);
  // White and Panjabi (1990): 17 of 17 + 16 + 15 + 14 + 12 degrees, 40 of 45.
  EXPECT_NEAR(share(split_, "vertebra_l5", 0), 17.0 / 74, 1e-12);
  EXPECT_NEAR(share(split_, "vertebra_c1", 2), 40.0 / 45, 1e-12);
  EXPECT_EQ(at(split_, "vertebra_c1").joint.coupled.at(0).joint, "atlantooccipital");
  for (const char* const leader :
       {"lumbar_spine", "thoracic_spine", "cervical_spine", "upper_cervical_spine"})
    EXPECT_TRUE(at(split_, leader).boneless) << leader;
}

TEST(Spine, ThoraxHangsOnItsMiddleAndAllElseOnTheThorax) {
  const Skeleton cage = split(human(), all(), Ribs::cage);
  EXPECT_EQ(parent(cage, "thorax"), "vertebra_t6");
  EXPECT_EQ(parent(cage, "girdle_left"), "thorax");
  EXPECT_EQ(parent(cage, "vertebra_l5"), "pelvis");
  EXPECT_EQ(parent(cage, "vertebra_c7"), "vertebra_t1");
  EXPECT_EQ(parent(cage, "head"), "vertebra_c1");
  EXPECT_EQ(parent(cage, "jaw"), "head");
  EXPECT_EQ(parent(split(human(), all(), Ribs::vertebrae), "thorax"), "vertebra_t4");
  std::set<std::string> no_sternum = all();
  no_sternum.erase("thorax");
  EXPECT_EQ(parent(split(human(), no_sternum, Ribs::vertebrae), "girdle_right"), "vertebra_t1");
}

// The head looks where it would with one segment a part, and a pose that was constrained stays.
TEST(Spine, PosesOfHumanTurnTheHeadAsFar) {
  const Rig whole = rig_of(human()), levels_ = rig_of(split(human(), all(), Ribs::cage));
  for (std::size_t angle = 0; angle < 3; ++angle) {
    std::vector<Quaterniond> heads;
    for (const Rig* rig : {&whole, &levels_}) {
      Pose pose = Pose::rest(rig->skeleton.segments.size());
      for (const char* const name : {"lumbosacral", "thoracolumbar", "cervicothoracic", "atlantooccipital"}) {
        const auto row = static_cast<std::size_t>(rig->skeleton.find_joint(name));
        std::array<double, 3> angles{};
        angles[angle] = 9 / degrees_per_radian;
        pose.rotation[row] = kinematics::rotation_from_angles(rig->skeleton.segments[row].joint, angles);
      }
      std::vector<ClampedJoint> clamped;
      kinematics::constrain(rig->skeleton, pose, clamped);
      EXPECT_TRUE(clamped.empty());
      Pose again = pose;
      kinematics::constrain(rig->skeleton, again, clamped);
      for (std::size_t s = 0; s < pose.rotation.size(); ++s)
        EXPECT_LT(pose.rotation[s].angularDistance(again.rotation[s]), 1e-12);
      heads.push_back(
          kinematics::forward(*rig, pose)[static_cast<std::size_t>(rig->skeleton.find_segment("head"))].q);
    }
    EXPECT_NEAR(heads[0].angularDistance(Quaterniond::Identity()), 36 / degrees_per_radian, 1e-9);
    EXPECT_LT(heads[0].angularDistance(heads[1]), 1e-9);
  }
}

// As far as a joint of `human` goes, its levels go with it.
TEST(Spine, LevelsGoAsFarAsTheJointThatLeadsThem) {
  const Skeleton split_ = split(human(), all(), Ribs::cage);
  for (const Level& level : levels()) {
    const Joint& own = at(split_, std::string(level.segment)).joint;
    for (std::size_t a = 0; a < 3; ++a) {
      const Joint& leader =
          split_.segments.at(static_cast<std::size_t>(split_.find_joint(own.coupled.at(a).joint))).joint;
      EXPECT_LE(own.sequence[a].min, own.coupled[a].ratio * leader.sequence[a].min + 1e-12) << own.name;
      EXPECT_GE(own.sequence[a].max, own.coupled[a].ratio * leader.sequence[a].max - 1e-12) << own.name;
    }
  }
}

TEST(Spine, NeighboursTakeOverWhatAnAbsentLevelTurned) {
  std::set<std::string> some = all();
  for (const char* const gone : {"vertebra_l5", "vertebra_l3", "vertebra_t1", "vertebra_c1"})
    some.erase(gone);
  const Skeleton split_ = split(human(), some, Ribs::cage);
  expect_whole_shares(split_, 4);
  EXPECT_NEAR(share(split_, "vertebra_l4", 0), (17.0 + 16) / 74, 1e-12);  // the next above
  EXPECT_NEAR(share(split_, "vertebra_l2", 0), (15.0 + 14) / 74, 1e-12);
  EXPECT_NEAR(share(split_, "vertebra_t2", 2), (8.0 + 9) / 71, 1e-12);  // none above that follows the same
  EXPECT_NEAR(share(split_, "head", 2), 1, 1e-12);
  EXPECT_EQ(parent(split_, "vertebra_l2"), "vertebra_l4");
  EXPECT_EQ(parent(split_, "vertebra_c7"), "vertebra_t2");
}

// A rib cage with its vertebrae in one: it turns as it did, and the neck hangs on it.
TEST(Spine, ThoraxWithoutVertebraeTurnsWhole) {
  const Skeleton split_ = split(human(), {"vertebra_l5", "thorax", "vertebra_c7", "head"}, Ribs::cage);
  expect_whole_shares(split_, 4);
  EXPECT_EQ(parent(split_, "thorax"), "vertebra_l5");
  EXPECT_EQ(parent(split_, "vertebra_c7"), "thorax");
  EXPECT_NEAR(share(split_, "thorax", 0), 1, 1e-12);
}

TEST(Spine, AnAtlasWithoutANeckTurnsForAllOfIt) {
  const Skeleton split_ = split(human(), {"thorax", "vertebra_t1", "vertebra_c1", "head"}, Ribs::cage);
  EXPECT_EQ(parent(split_, "vertebra_c1"), "vertebra_t1");
  std::map<std::string, double> sums = shares(split_);
  EXPECT_NEAR(sums.at("cervicothoracic flexion"), 1, 1e-12);
  EXPECT_NEAR(sums.at("atlantooccipital flexion"), 1, 1e-12);
  const Joint& atlas = at(split_, "vertebra_c1").joint;
  EXPECT_GE(atlas.sequence[0].max * degrees_per_radian,
            40 + 30 * 20.0 / 45 - 1e-9);  // as far as both lead it
}

TEST(Spine, PartsThatAreAbsentLeadNothing) {
  Skeleton trunk;  // as a scan of the lumbar spine alone leaves it
  for (const Segment& segment : human().segments)
    if (segment.name == "pelvis" || segment.name == "lumbar") trunk.segments.push_back(segment);
  const Skeleton split_ = split(trunk, {"vertebra_l2", "vertebra_l1"}, Ribs::cage);
  ASSERT_EQ(split_.segments.size(), 4U);
  EXPECT_EQ(parent(split_, "vertebra_l2"), "pelvis");
  expect_whole_shares(split_, 1);
}

}  // namespace
}  // namespace ecorche::spine
