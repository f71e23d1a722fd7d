// SPDX-License-Identifier: Apache-2.0
// The flesh of the present pose, brought near to its balance.
#include <utility>
#include <vector>

#include <ecorche/kinematics/forward.hpp>
#include "proto/arrays.hpp"
#include "runtime/server/handlers/handlers.hpp"
#include "runtime/server/handlers/tissue_rows.hpp"
#include "runtime/server/resources/guarded.hpp"
#include "runtime/server/session/quality_job.hpp"
#include "runtime/settle/settle_flesh.hpp"

namespace ecorche::server {
namespace {

// What is asked, and what came of it.
struct SettleRequest {
  std::uint64_t id = 0;
  std::shared_ptr<const ServedModel> model;
  std::vector<std::uint32_t> tissues;  // ascending
  PoseRequest pose;
  runtime::QualityThresholds thresholds;
  std::stop_token stop;
  Status status;
  v1::Envelope envelope;
  std::shared_ptr<wire::Payload> payload = std::make_shared<wire::Payload>();
};

// Where the pose has the body: what is measured lies as it was scanned.
void carry(const RigidTransform& root, std::vector<float>& points) {
  for (std::size_t i = 0; i < points.size(); i += 3) {
    Eigen::Map<Eigen::Vector3f> point(&points[i]);
    point = (root * point.cast<double>()).cast<float>();
  }
}

Status settle(SettleRequest& asked) {
  const ServedModel& served = *asked.model;
  const runtime::FleshSettler* settler = nullptr;
  Status made = guarded("settle", [&] {
    settler = &served.settler();
    return Status{};
  });
  if (made.code == StatusCode::invalid_argument) made.code = StatusCode::failed_precondition;
  if (!made.ok()) return made;
  Context context;
  context.stop = asked.stop;
  const BodyPool::Lease body = pose_still(served, asked.pose, asked.tissues);
  if (!body) return {StatusCode::unavailable, "settle: the body could not be posed (see the last PoseAck)"};
  const runtime::Settled done = settler->run(*body, {}, context);
  v1::Settled& out = *asked.envelope.mutable_settled();
  out.set_pose_sequence(asked.pose.sequence);
  out.set_steps(static_cast<std::uint32_t>(done.steps));
  out.set_came_to_rest(done.came_to_rest);
  out.set_largest_move(done.largest_move_mm);
  *out.mutable_quality() = describe(served.meter().measure(*body, asked.tissues, asked.thresholds),
                                    asked.tissues, asked.pose.sequence);
  const RigidTransform root = kinematics::forward(served.model().rig, body->pose)[0];
  for (const std::uint32_t t : asked.tissues) {
    carry(root, body->tissues[t]);
    v1::SettledTissue& part = *out.add_parts();
    part.set_tissue(t);
    *part.mutable_positions() = wire::append(*asked.payload, std::span<const float>(body->tissues[t]), 3);
  }
  return {};
}

void on_settled(Client& client, SettleRequest& asked) {
  client.pending().settle.reset();
  if (client.over()) return;
  if (!asked.status.ok()) return client.answer_status(asked.id, asked.status);
  client.answer(asked.id, std::move(asked.envelope), std::move(asked.payload));
}

}  // namespace

Status handle_settle_flesh(Client& client, const v1::SettleFlesh& settle_flesh, const Request& request) {
  if (client.pending().settle)
    return {StatusCode::resource_exhausted, "settle: one is being made for this connection (wait for it)"};
  const Session& session = *client.session();
  const auto asked = std::make_shared<SettleRequest>();
  asked->id = request.id();
  asked->model = session.model();
  asked->pose = session.poses().present();
  asked->thresholds = session.thresholds();
  Status status = tissue_rows("settle", settle_flesh.tissues(), asked->model->model(), asked->tissues);
  if (!status.ok()) return status;
  asked->stop = client.pending().settle.emplace().get_token();
  client.registry().executor().run(
      Service::background, [asked] { asked->status = guarded("settle", [&] { return settle(*asked); }); },
      client.callback([asked](Client& asking) { on_settled(asking, *asked); }), client.account());
  return {};
}

}  // namespace ecorche::server
