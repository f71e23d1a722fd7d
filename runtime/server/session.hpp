// SPDX-License-Identifier: Apache-2.0
// One posed body and those who watch it.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "runtime/server/options.hpp"
#include "runtime/server/pose_job.hpp"
#include "runtime/server/workers.hpp"

namespace ecorche::server {

/// Poses overtaken by newer ones since the last that was taken up.
struct Skipped {
  static constexpr std::size_t most_told = 256;
  std::uint64_t count = 0;
  std::deque<std::uint64_t> newest;  ///< sequence numbers, oldest first

  void add(std::uint64_t sequence);
};

/// A connection, as its session sees it. Called on the I/O thread.
class Member {
 public:
  virtual ~Member() = default;
  virtual void deliver(const PosedFrame& frame) = 0;
  /// Only to the member that holds control.
  virtual void pose_done(const PoseOutcome& outcome, const Skipped& skipped) = 0;
};

/// Lives on the I/O thread. Poses wait in one slot, where the newest wins; one job at a time runs on the
/// workers and owns `body_` until its end is posted back.
class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(net::io_context& io, Workers& workers, std::shared_ptr<const ServedModel> model, std::string name,
          bool named, const Limits& limits);

  const std::string& name() const { return name_; }
  const std::shared_ptr<const ServedModel>& model() const { return model_; }

  /// Gives control to the member when nobody holds it (and nobody did during the last `linger_seconds`).
  v1::Role join(Member& member);
  void leave(Member& member);

  /// The subscription's number, the same for equal wants. Frames follow, the present pose first.
  std::uint32_t subscribe(Member& member, const Want& want);
  /// False where the member has no such subscription.
  bool unsubscribe(Member& member, std::uint32_t id);

  /// From the member that holds control; already checked against the rig.
  void pose(PoseRequest request);

  /// Nobody is here, nor may come back.
  bool over(Clock::time_point now) const;

 private:
  struct Row {
    Subscription subscription;
    std::set<Member*> members;
  };

  void start_job();
  void take_up(PoseJob& job);
  void finish_pose(PoseOutcome outcome, const Skipped& skipped, const PoseRequest& request, bool refresh);
  void publish(const PosedFrame& frame);

  net::io_context& io_;
  Workers& workers_;
  std::shared_ptr<const ServedModel> model_;
  std::string name_;
  bool named_;
  Limits limits_;

  std::set<Member*> members_;
  Member* controller_ = nullptr;
  std::optional<Clock::time_point> control_left_;  ///< when the last controller went
  Clock::time_point last_seen_ = Clock::now();     ///< when the last member went

  std::vector<Row> rows_;
  std::uint32_t last_subscription_ = 0;
  std::set<std::uint32_t> fresh_;  ///< subscriptions that have not seen the present pose

  std::optional<PoseRequest> slot_;
  Skipped skipped_;
  PoseRequest present_;
  std::uint64_t frames_ = 0;
  bool busy_ = false;
  runtime::PosedBody body_;  ///< the job's while busy_
  net::steady_timer pace_;
  Clock::time_point next_start_ = Clock::now();
  bool pacing_ = false;
};

}  // namespace ecorche::server
