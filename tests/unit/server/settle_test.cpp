// SPDX-License-Identifier: Apache-2.0
// Settling over the wire, held against the same made offline.
#include "runtime/settle/settle_flesh.hpp"

#include <memory>

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/runtime/quality_meter.hpp>
#include "proto/arrays.hpp"
#include "tests/unit/fem/boned_beam.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

v1::Envelope settle_request(const std::vector<std::string>& tissues = {}) {
  v1::Envelope envelope;
  v1::SettleFlesh& asked = *envelope.mutable_settle_flesh();
  for (const std::string& name : tissues) asked.add_tissues(name);
  return envelope;
}

std::string refusal_to_settle(client::Client& client, const v1::Envelope& request) {
  try {
    client.call(request);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(SettleTest, ASettledBodyIsThatMadeOffline) {
  const TestServer server(Limits{}, fem::boned());
  TestClient client(server);
  Pose pose = client.bent(0.9);
  pose.root_translation = {300, -40, 7};
  pose.rotation[0] = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized());
  client.send(4, pose);
  client.next_ack();

  const auto model = std::make_shared<const Model>(server.model());
  const runtime::BodyPoser poser(model);
  runtime::PosedBody body = poser.make_frame();
  ASSERT_TRUE(poser
                  .run(pose, runtime::Skinning::cor, poser.all_tissues(), body, runtime::NodesOf::body,
                       runtime::Root::still)
                  .ok());
  const std::vector<std::vector<float>> skinned = body.tissues;
  const runtime::Settled done = runtime::FleshSettler(*model, {}).run(body, {}, {});
  const runtime::PoseQuality quality = runtime::QualityMeter(model).measure(body, poser.all_tissues());
  const RigidTransform root = kinematics::forward(model->rig, body.pose)[0];

  const wire::Frame answer = client.client().call(settle_request());
  const v1::Settled& settled = answer.envelope.settled();
  EXPECT_EQ(settled.pose_sequence(), 4U);
  EXPECT_EQ(settled.steps(), static_cast<std::uint32_t>(done.steps));
  EXPECT_EQ(settled.came_to_rest(), done.came_to_rest);
  EXPECT_EQ(settled.largest_move(), done.largest_move_mm);
  EXPECT_GT(settled.largest_move(), 1);
  EXPECT_EQ(settled.quality().pose_sequence(), 4U);
  EXPECT_EQ(settled.quality().inverted_tets(), quality.inverted_tets);
  EXPECT_EQ(settled.quality().volume_change(), quality.volume_change);
  ASSERT_EQ(settled.parts_size(), static_cast<int>(model->tissues.size()));
  float farthest = 0;
  for (const v1::SettledTissue& part : settled.parts()) {
    std::span<const float> positions;
    ASSERT_TRUE(wire::find(part.positions(), answer.payload, 3, positions));
    const std::vector<float>& expected = body.tissues[part.tissue()];
    ASSERT_EQ(positions.size(), expected.size());
    for (std::size_t i = 0; i < positions.size(); i += 3) {
      const Eigen::Vector3f at =
          (root * Eigen::Map<const Eigen::Vector3f>(&expected[i]).cast<double>()).cast<float>();
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(positions[i + c], at[static_cast<Eigen::Index>(c)]);
        farthest = std::max(farthest, std::abs(expected[i + c] - skinned[part.tissue()][i + c]));
      }
    }
  }
  EXPECT_GT(farthest, 1);

  // One tissue alone, and again: what was factored is at hand.
  const std::string& name = model->tissues[0].name;
  const wire::Frame one = client.client().call(settle_request({name, name}));
  ASSERT_EQ(one.envelope.settled().parts_size(), 1);
  EXPECT_EQ(one.envelope.settled().parts(0).tissue(), 0U);
  EXPECT_EQ(one.envelope.settled().parts(0).positions().count(),
            static_cast<std::uint64_t>(model->tissues[0].V.rows()));
}

TEST(SettleTest, IsRefusedByName) {
  const TestServer boned(Limits{}, fem::boned());
  TestClient client(boned);
  EXPECT_NE(refusal_to_settle(client.client(), settle_request({"nose"})).find("settle: no tissue 'nose'"),
            std::string::npos);
  Model soft = fem::boned();
  soft.tet_label.assign(soft.tet_count(), TetMesh::soft);
  const TestServer without(Limits{}, soft);
  TestClient other(without);
  EXPECT_NE(refusal_to_settle(other.client(), settle_request()).find("no soft tet hangs on a bone"),
            std::string::npos);
}

}  // namespace
}  // namespace ecorche::server
