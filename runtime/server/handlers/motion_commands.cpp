// SPDX-License-Identifier: Apache-2.0
// Poses that the server finds, plays and keeps.
#include <algorithm>
#include <cmath>
#include <utility>

#include <ecorche/kinematics/ik.hpp>
#include <ecorche/wire/convert.hpp>
#include "runtime/server/handlers/connection.hpp"
#include "runtime/server/resources/guarded.hpp"

namespace ecorche::server {

struct IkOutcome {
  Status status;
  kinematics::IkResult result;
};

namespace {

constexpr int kMostTargets = 64;
constexpr int kMostSolving = 2;    // of one connection
constexpr double kFarthest = 1e6;  // mm, as of translations
constexpr double kSlowest = 0.01, kFastest = 100;

bool near(const Eigen::Vector3d& v) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= kFarthest;
}

Status read_problem(const v1::SolveIk& request, std::size_t segments, kinematics::IkProblem& out) {
  if (request.targets_size() < 1 || request.targets_size() > kMostTargets) {
    return {StatusCode::invalid_argument,
            "ik: " + std::to_string(request.targets_size()) + " targets (give 1 to 64)"};
  }
  out.move_root = request.move_root();
  for (const v1::IkTarget& target : request.targets()) {
    if (target.segment() >= segments) {
      return {StatusCode::invalid_argument,
              "ik: no segment " + std::to_string(target.segment()) + " (count from 0, as the skeleton does)"};
    }
    kinematics::IkTarget& one = out.targets.emplace_back();
    one.segment = target.segment();
    one.point = wire::from_proto(target.rest_point());
    one.goal = wire::from_proto(target.target());
    one.weight = target.weight() == 0 ? 1 : target.weight();
    if (!near(one.point) || !near(one.goal) || !(one.weight > 0 && one.weight <= kFarthest))
      return {StatusCode::invalid_argument, "ik: a target beyond 1e6, or no number (mend it)"};
  }
  return {};
}

}  // namespace

void Connection::handle_solve(const v1::Envelope& request) {
  const std::uint64_t id = request.request_id();
  const v1::SolveIk& solve = request.solve_ik();
  const auto check = [&](kinematics::IkProblem& problem, Pose& start) -> Status {
    if (Status status = may("ik", solve.apply_as() != 0); !status.ok()) return status;
    const std::size_t segments = session_->model()->model().segment_count();
    if (Status status = read_problem(solve, segments, problem); !status.ok()) return status;
    if (solve.apply_as() != 0) {
      if (Status status = check_sequence(solve.apply_as()); !status.ok()) return status;
    }
    start = session_->poses().present().pose;
    if (solve.rotation().empty()) return {};
    v1::PoseUpdate update;
    wire::to_proto(start, update);
    *update.mutable_rotation() = solve.rotation();
    return wire::from_proto(update, segments, start);
  };
  kinematics::IkProblem problem;
  Pose start;
  Status status = check(problem, start);
  if (status.ok() && solving_ >= kMostSolving)
    status = {StatusCode::resource_exhausted, "ik: two are being solved for this connection (wait for them)"};
  if (!status.ok()) return answer_status(id, status);

  ++solving_;
  const auto outcome = std::make_shared<IkOutcome>();
  const auto work = [outcome, problem = std::move(problem), start = std::move(start),
                     model = session_->model()] {
    outcome->status = guarded("ik", [&] {
      outcome->result = kinematics::solve_ik(model->model().rig, start, problem);
      return Status{};
    });
  };
  registry_.executor().run_request(
      work,
      [weak = weak_from_this(), outcome, id, solve] {
        if (const auto self = weak.lock()) self->take_back([&] { self->solved(id, solve, *outcome); });
      },
      account_);
}

void Connection::solved(std::uint64_t id, const v1::SolveIk& request, const IkOutcome& outcome) {
  --solving_;
  if (closed_ || ending_) return;
  Status status = outcome.status;
  // Meanwhile another may have taken control, or a later pose have come.
  if (status.ok() && request.apply_as() != 0) {
    status = may("ik", true);
    if (status.ok()) status = check_sequence(request.apply_as());
  }
  if (!status.ok()) return answer_status(id, status);
  const kinematics::IkResult& result = outcome.result;
  v1::Envelope envelope;
  v1::IkSolved& solved = *envelope.mutable_ik_solved();
  v1::PoseUpdate pose;
  wire::to_proto(result.pose, pose);
  *solved.mutable_root_translation() = pose.root_translation();
  *solved.mutable_rotation() = pose.rotation();
  *solved.mutable_translation() = pose.translation();
  solved.mutable_residual()->Assign(result.away_mm.begin(), result.away_mm.end());
  answer(id, std::move(envelope));
  if (request.apply_as() == 0) return;
  last_sequence_ = request.apply_as();
  PoseRequest next;
  next.sequence = request.apply_as();
  next.pose = result.pose;
  next.skinning = session_->poses().present().skinning;
  session_->pose(std::move(next));
}

void Connection::handle_clips(const v1::Envelope& request) {
  if (const Status status = may("clips", false); !status.ok())
    return answer_status(request.request_id(), status);
  v1::Envelope envelope;
  v1::ClipList& list = *envelope.mutable_clip_list();
  for (const auto& clip : registry_.clips_for(*session_->model())) {
    v1::ClipSummary& one = *list.add_clips();
    one.set_name(clip->name);
    one.set_seconds(clip->seconds());
    one.set_frames_per_second(clip->frames_per_second());
  }
  answer(request.request_id(), std::move(envelope));
}

void Connection::handle_play(const v1::Envelope& request) {
  const std::uint64_t id = request.request_id();
  const v1::PlayClip& play = request.play_clip();
  if (const Status status = may("clip", true); !status.ok()) return answer_status(id, status);
  if (play.name().empty()) {
    session_->stop_clip();
    return answer_status(id, {});
  }
  const double speed = play.speed() == 0 ? 1 : play.speed();
  if (!(speed >= kSlowest && speed <= kFastest))
    return answer_status(id, {StatusCode::invalid_argument, "clip: the speed is not 0.01 to 100 (mend it)"});
  const auto clips = registry_.clips_for(*session_->model());
  const auto clip =
      std::find_if(clips.begin(), clips.end(), [&](const auto& c) { return c->name == play.name(); });
  if (clip == clips.end())
    return answer_status(id, {StatusCode::not_found, "clip: none of that name (ListClips has the names)"});
  answer_status(id, {});
  session_->play(*clip, speed, play.loop());
}

void Connection::handle_record(const v1::Envelope& request) {
  const std::uint64_t id = request.request_id();
  if (const Status status = may("record", true); !status.ok()) return answer_status(id, status);
  if (!request.record().on()) return finish_recording(id);
  if (session_->recorder().running()) {
    return answer_status(
        id, {StatusCode::failed_precondition, "record: a recording runs in this session (end it first)"});
  }
  answer_status(id, registry_.recordings().begin(*session_, request.record().name(), address_));
}

void Connection::finish_recording(std::uint64_t id) {
  if (!session_->recorder().running()) {
    return answer_status(
        id, {StatusCode::failed_precondition, "record: no recording runs in this session (begin one)"});
  }
  registry_.recordings().finish(*session_, [weak = weak_from_this(), id](const Status& status) {
    if (const auto self = weak.lock()) self->take_back([&] { self->answer_status(id, status); });
  });
}

}  // namespace ecorche::server
