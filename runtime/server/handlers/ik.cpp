// SPDX-License-Identifier: Apache-2.0
// Poses that the server finds.
#include <string>
#include <utility>

#include <ecorche/kinematics/ik.hpp>
#include <ecorche/wire/convert.hpp>
#include "runtime/server/handlers/handlers.hpp"
#include "runtime/server/handlers/pose_sequence.hpp"
#include "runtime/server/resources/guarded.hpp"

namespace ecorche::server {
namespace {

constexpr int kMaxTargets = 64;
constexpr int kMaxPendingIk = 2;      // of one client
constexpr double kMaxDistance = 1e6;  // mm, as of translations

struct IkOutcome {
  Status status;
  kinematics::IkResult result;
};

bool near(const Eigen::Vector3d& v) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= kMaxDistance;
}

Status read_problem(const v1::SolveIk& solve, std::size_t segments, kinematics::IkProblem& out) {
  if (solve.targets_size() < 1 || solve.targets_size() > kMaxTargets) {
    return {StatusCode::invalid_argument,
            "ik: " + std::to_string(solve.targets_size()) + " targets (give 1 to 64)"};
  }
  out.move_root = solve.move_root();
  for (const v1::IkTarget& target : solve.targets()) {
    if (target.segment() >= segments) {
      return {StatusCode::invalid_argument,
              "ik: no segment " + std::to_string(target.segment()) + " (count from 0, as the skeleton does)"};
    }
    kinematics::IkTarget& one = out.targets.emplace_back();
    one.segment = target.segment();
    one.point = wire::from_proto(target.rest_point());
    one.goal = wire::from_proto(target.target());
    one.weight = target.weight() == 0 ? 1 : target.weight();
    if (!near(one.point) || !near(one.goal) || !(one.weight > 0 && one.weight <= kMaxDistance))
      return {StatusCode::invalid_argument, "ik: a target beyond 1e6, or no number (mend it)"};
  }
  return {};
}

Status read_start(const v1::SolveIk& solve, std::size_t segments, const Pose& present, Pose& out) {
  out = present;
  if (solve.rotation().empty()) return {};
  v1::PoseUpdate update;
  wire::to_proto(present, update);
  *update.mutable_rotation() = solve.rotation();
  return wire::from_proto(update, segments, out);
}

void answer_solved(Client& client, std::uint64_t id, const kinematics::IkResult& result) {
  v1::Envelope envelope;
  v1::IkSolved& solved = *envelope.mutable_ik_solved();
  v1::PoseUpdate pose;
  wire::to_proto(result.pose, pose);
  *solved.mutable_root_translation() = pose.root_translation();
  *solved.mutable_rotation() = pose.rotation();
  *solved.mutable_translation() = pose.translation();
  solved.mutable_residual()->Assign(result.away_mm.begin(), result.away_mm.end());
  client.answer(id, std::move(envelope));
}

void on_solved(Client& client, const v1::Envelope& request, const IkOutcome& outcome) {
  --client.pending().ik;
  if (client.over()) return;
  const std::uint64_t apply_as = request.solve_ik().apply_as();
  Status status = outcome.status;
  // Meanwhile another may have taken control, or a later pose have come.
  if (status.ok() && apply_as != 0) status = check_needs(client, request);
  if (status.ok() && apply_as != 0) {
    const std::uint64_t newest = client.session()->poses().last_sequence();
    status = check_sequence(apply_as, client.last_sequence(), newest);
  }
  if (!status.ok()) return client.answer_status(request.request_id(), status);
  answer_solved(client, request.request_id(), outcome.result);
  if (apply_as == 0) return;
  client.set_last_sequence(apply_as);
  PoseRequest next;
  next.sequence = apply_as;
  next.pose = outcome.result.pose;
  next.skinning = client.session()->poses().present().skinning;
  client.session()->pose(std::move(next));
}

}  // namespace

Status handle_solve_ik(Client& client, const v1::SolveIk& solve, const Request& request) {
  const Session& session = *client.session();
  const std::size_t segments = session.model()->model().segment_count();
  kinematics::IkProblem problem;
  if (Status status = read_problem(solve, segments, problem); !status.ok()) return status;
  if (solve.apply_as() != 0) {
    const std::uint64_t newest = session.poses().last_sequence();
    if (Status status = check_sequence(solve.apply_as(), client.last_sequence(), newest); !status.ok())
      return status;
  }
  Pose start;
  if (Status status = read_start(solve, segments, session.poses().present().pose, start); !status.ok())
    return status;
  if (client.pending().ik >= kMaxPendingIk) {
    return {StatusCode::resource_exhausted, "ik: two are being solved for this connection (wait for them)"};
  }
  ++client.pending().ik;
  const auto outcome = std::make_shared<IkOutcome>();
  client.registry().executor().run_request(
      [outcome, problem = std::move(problem), start = std::move(start), model = session.model()] {
        outcome->status = guarded("ik", [&] {
          outcome->result = kinematics::solve_ik(model->model().rig, start, problem);
          return Status{};
        });
      },
      client.callback(
          [outcome, asked = request.envelope](Client& asking) { on_solved(asking, asked, *outcome); }),
      client.account());
  return {};
}

}  // namespace ecorche::server
