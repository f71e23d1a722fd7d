// SPDX-License-Identifier: Apache-2.0
// Quality in every reply, of the pose itself or of one before it.
#include <set>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/quality_meter.hpp>
#include <ecorche/runtime/verdict.hpp>
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

double angle_of(std::uint64_t sequence) {
  return 0.002 * static_cast<double>(sequence % 400);
}

// What the frame tells is what offline measuring says of the pose that it names.
void expect_measured(const TestServer& server, const Pose& pose, const v1::MeshFrame& frame,
                     const runtime::QualityThresholds& thresholds = {}) {
  ASSERT_TRUE(frame.has_quality()) << frame.pose_sequence();
  const v1::PoseQuality& told = frame.quality();
  ASSERT_LE(told.pose_sequence(), frame.pose_sequence());
  const auto model = std::make_shared<const Model>(server.model());
  const runtime::BodyPoser poser(model);
  runtime::PosedBody body = poser.make_frame();
  ASSERT_TRUE(poser
                  .run(pose, runtime::Skinning::cor, poser.all_tissues(), body, runtime::NodesOf::body,
                       runtime::Root::still)
                  .ok());
  std::vector<std::uint32_t> tissues;
  for (const v1::TissueChange& change : told.tissues()) tissues.push_back(change.tissue());
  const runtime::PoseQuality expected = runtime::QualityMeter(model).measure(body, tissues, thresholds);
  EXPECT_EQ(told.inverted_tets(), expected.inverted_tets) << told.pose_sequence();
  EXPECT_EQ(told.min_det_f(), expected.min_det_f);
  EXPECT_EQ(told.volume_change(), expected.volume_change);
  EXPECT_EQ(told.unsigned_volume_change(), expected.unsigned_volume_change);
  EXPECT_EQ(told.max_volume_change(), thresholds.max_volume_change);
  EXPECT_EQ(told.tissue_factor(), thresholds.tissue_factor);
  ASSERT_TRUE(told.has_worst_tissue());
  EXPECT_EQ(told.worst_tissue(), tissues.at(runtime::worst_tissue(expected)));
  ASSERT_EQ(told.doubtful_size(), static_cast<int>(expected.doubtful.size()));
  for (int j = 0; j < told.doubtful_size(); ++j) {
    const runtime::DoubtfulJoint& joint = expected.doubtful[static_cast<std::size_t>(j)];
    EXPECT_EQ(told.doubtful(j).joint(), static_cast<std::uint32_t>(joint.joint));
    EXPECT_EQ(told.doubtful(j).turned(), joint.turned);
    EXPECT_EQ(told.doubtful(j).confidence(), joint.confidence);
  }
  EXPECT_EQ(told.overlap().mm(), expected.overlap.mm);
  EXPECT_EQ(told.has_overlap(), expected.overlap.mm > 0);
  EXPECT_EQ(told.overlap().bone(), expected.overlap.bone);
  EXPECT_EQ(told.overlap().into(), expected.overlap.into);
  EXPECT_EQ(told.overlap().at().z(), expected.overlap.at.z());
  EXPECT_EQ(told.max_bone_overlap(), thresholds.max_bone_overlap_mm);
  EXPECT_EQ(told.verdict(), expected.pass ? v1::PoseQuality::VERDICT_PASS : v1::PoseQuality::VERDICT_WARN);
  for (std::size_t t = 0; t < tissues.size(); ++t) {
    const v1::TissueChange& change = told.tissues(static_cast<int>(t));
    EXPECT_EQ(change.share(), expected.tissues[t].share) << expected.tissues[t].name;
    EXPECT_EQ(change.max_share(), expected.tissues[t].max_share);
  }
}

void expect_measured(const TestServer& server, const TestClient& client, const v1::MeshFrame& frame,
                     const runtime::QualityThresholds& thresholds = {}) {
  expect_measured(server, client.bent(angle_of(frame.quality().pose_sequence())), frame, thresholds);
}

TEST(Quality, IsThePosesOwnWhereNoneCameShortlyBefore) {
  const TestServer server;
  TestClient client(server);
  client.subscribe_mesh({"skin"});
  const wire::Frame first = client.next_mesh(0);
  EXPECT_EQ(first.envelope.mesh_frame().quality().tissues_size(), 1);
  expect_measured(server, client, first.envelope.mesh_frame());
  for (const std::uint64_t sequence : {100, 300}) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    client.send(sequence, client.bent(angle_of(sequence)));
    const wire::Frame frame = client.next_mesh(sequence);
    EXPECT_EQ(frame.envelope.mesh_frame().quality().pose_sequence(), sequence);
    EXPECT_GT(frame.envelope.mesh_frame().timings().posed(), 0U);
    expect_measured(server, client, frame.envelope.mesh_frame());
  }
}

TEST(Quality, FollowsAStreamBesideIt) {
  const TestServer server;
  TestClient client(server, "shared"), observer(server, "shared");
  client.subscribe_mesh();
  observer.subscribe_mesh({"skin"});
  std::uint64_t newest = 0;
  std::set<std::uint64_t> judged;
  for (std::uint64_t sequence = 1; sequence <= 2000 && judged.size() < 4; ++sequence) {
    client.send(sequence, client.bent(angle_of(sequence)));
    for (TestClient* who : {&client, &observer}) {
      const wire::Frame frame = who->next_mesh(sequence);
      const v1::PoseQuality& told = frame.envelope.mesh_frame().quality();
      EXPECT_EQ(told.tissues_size(), who == &observer ? 1 : client.opened().tissues_size());
      if (who == &observer) continue;
      EXPECT_GE(told.pose_sequence(), newest);
      newest = told.pose_sequence();
      if (judged.insert(newest).second) expect_measured(server, client, frame.envelope.mesh_frame());
    }
  }
  EXPECT_EQ(judged.size(), 4U);
}

TEST(Quality, IsJudgedByThresholdsFromTheNextFrameOn) {
  const TestServer server;
  TestClient client(server);
  client.subscribe_mesh();
  client.next_mesh(0);
  v1::Envelope request;
  request.mutable_set_thresholds()->set_max_volume_change(1e-9);
  client.client().call(request);
  client.send(200, client.bent(angle_of(200)));
  const wire::Frame frame = client.next_mesh(200);
  expect_measured(server, client, frame.envelope.mesh_frame(), {.max_volume_change = 1e-9});
  EXPECT_EQ(frame.envelope.mesh_frame().quality().verdict(), v1::PoseQuality::VERDICT_WARN);
}

TEST(Quality, TissuesAreJudgedByTheirGroupsTimesAFactor) {
  const TestServer server;
  TestClient client(server);
  client.subscribe_mesh();
  client.next_mesh(0);
  v1::Envelope request;
  request.mutable_set_thresholds()->set_tissue_factor(1e-6);
  client.client().call(request);
  client.send(200, client.bent(angle_of(200)));
  const wire::Frame frame = client.next_mesh(200);
  expect_measured(server, client, frame.envelope.mesh_frame(), {.tissue_factor = 1e-6});
  EXPECT_EQ(frame.envelope.mesh_frame().quality().verdict(), v1::PoseQuality::VERDICT_WARN);
}

// The toy body with the ends of two bones 1 mm apart, below the joint at 200 mm that turns them: a corner of
// the narrow one goes 1.7 mm into the other when it turns by 0.6.
Model with_near_bones() {
  Model model = test::toy_model();
  for (Tissue& tissue : model.tissues) {
    if (tissue.segment == 1) tissue.V.col(2).array() += 20;
    if (tissue.segment != 2) continue;
    tissue.V.col(2).array() -= 29;
    tissue.V.col(0) *= 0.5F;
  }
  return model;
}

// Of a server that works nothing out by itself.
TestHooks idle() {
  TestHooks hooks;
  hooks.may_coarsen = [] { return false; };
  return hooks;
}

TEST(Quality, NoFrameWaitsForDistancesOfBonesAndAllOfItFollows) {
  const TestServer server({}, idle(), with_near_bones());
  TestClient client(server);
  client.subscribe_mesh();
  client.next_mesh(0);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  client.send(300, client.bent(angle_of(300)));
  const wire::Frame first = client.next_mesh(300);
  EXPECT_EQ(first.envelope.mesh_frame().quality().pose_sequence(), 300U);
  EXPECT_TRUE(first.envelope.mesh_frame().quality().overlap_pending());
  EXPECT_FALSE(first.envelope.mesh_frame().quality().has_overlap());
  const wire::Frame second = client.next_mesh(300);
  EXPECT_FALSE(second.envelope.mesh_frame().quality().overlap_pending());
  EXPECT_GT(second.envelope.mesh_frame().quality().overlap().mm(), 1);
  expect_measured(server, client, second.envelope.mesh_frame());
}

TEST(Quality, WhoWantsItWithEveryFrameGetsAllOfIt) {
  const TestServer server({}, idle(), with_near_bones());
  TestClient client(server);
  client.subscribe_mesh({}, true);
  client.next_mesh(0);
  client.send(300, client.bent(angle_of(300)));
  const wire::Frame frame = client.next_mesh(300);
  EXPECT_FALSE(frame.envelope.mesh_frame().quality().overlap_pending());
  expect_measured(server, client, frame.envelope.mesh_frame());
}

TEST(Quality, WhoWantsItWithEveryFrameIsNotGivenWhatAnotherWasToldAtOnce) {
  const TestServer server({}, idle(), with_near_bones());
  TestClient client(server, "shared"), observer(server, "shared");
  client.subscribe_mesh();
  client.next_mesh(0);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  client.send(300, client.bent(angle_of(300)));
  observer.subscribe_mesh({}, true);
  const wire::Frame frame = observer.next_mesh(300);
  EXPECT_FALSE(frame.envelope.mesh_frame().quality().overlap_pending());
  expect_measured(server, observer, frame.envelope.mesh_frame());
}

TEST(Quality, OfABodyFarAwayIsThatOfTheBody) {
  const TestServer server;
  TestClient client(server);
  client.subscribe_mesh();
  client.next_mesh(0);
  for (const std::uint64_t sequence : {100, 101, 102, 103}) {  // its own, then beside the stream
    if (sequence < 102) std::this_thread::sleep_for(std::chrono::milliseconds(200));
    Pose pose = client.bent(0);
    pose.rotation[0] = Eigen::AngleAxisd(2, Eigen::Vector3d(1, -2, 3).normalized());
    pose.root_translation = Eigen::Vector3d(20000, 20000, -20000);
    client.send(sequence, pose);
    const wire::Frame frame = client.next_mesh(sequence);
    const v1::PoseQuality& told = frame.envelope.mesh_frame().quality();
    EXPECT_EQ(told.verdict(), v1::PoseQuality::VERDICT_PASS) << sequence;
    EXPECT_NEAR(told.min_det_f(), 1, 1e-5);
    EXPECT_LT(told.bone_rigidity(), 1e-4);
    expect_measured(server, pose, frame.envelope.mesh_frame());
  }
}

}  // namespace
}  // namespace ecorche::server
