// SPDX-License-Identifier: Apache-2.0
// One posed body and those who watch it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "runtime/server/resources/memory_budget.hpp"
#include "runtime/server/resources/metrics.hpp"
#include "runtime/server/resources/options.hpp"
#include "runtime/server/schedule/alarm.hpp"
#include "runtime/server/schedule/destroy_later.hpp"
#include "runtime/server/schedule/executor.hpp"
#include "runtime/server/schedule/stream_activity.hpp"
#include "runtime/server/schedule/turn_queue.hpp"
#include "runtime/server/session/change_notifier.hpp"
#include "runtime/server/session/clip.hpp"
#include "runtime/server/session/control.hpp"
#include "runtime/server/session/frame_planner.hpp"
#include "runtime/server/session/hung_spheres.hpp"
#include "runtime/server/session/job_pacer.hpp"
#include "runtime/server/session/job_reporter.hpp"
#include "runtime/server/session/pose_slot.hpp"
#include "runtime/server/session/presence.hpp"
#include "runtime/server/session/probe_queue.hpp"
#include "runtime/server/session/quality_tracker.hpp"
#include "runtime/server/session/session_recorder.hpp"
#include "runtime/server/session/subscription_table.hpp"
#include "runtime/server/session/volume_jobs.hpp"

namespace ecorche::server {

class Journal;

/// What all sessions of a server share.
struct Services {
  net::io_context& io;
  Executor& executor;
  const MemoryBudget& memory;
  TurnQueue& quality_turns;  ///< whose present pose is measured next
  TurnQueue& first_frames;   ///< whose newcomers are shown the present pose next, beside streams
  StreamActivity& activity;
  Metrics& metrics;
  DestroyLater destroy_later;
  Journal* journal = nullptr;  ///< for what goes wrong; may be null
};

/// Whose a session is.
struct SessionOwner {
  std::string address = {};               ///< of the client that made it
  std::shared_ptr<const Pool> kept = {};  ///< its part of what all keep; null: it has no share of its own
  std::shared_ptr<Account> account = {};  ///< jobs are done on a part of it; may be null
};

/// Lives on the I/O thread, and wires what a posed body is made of:
///
///   Control            members, and who of them poses; Presence tells them of each other
///   PoseSlot           the pose that waits, where the newest wins, and the one that is shown
///   SubscriptionTable  who sees what; FramePlanner chooses of it what a job makes
///   VolumeJobs         volumes, which take longer than all else of a pose, beside the meshes of newer poses
///   ProbeQueue, QualityTracker, SessionRecorder, ClipPlayer
///
/// One job of meshes at a time runs on the executor until its end is posted back. Only what is recorded keeps
/// together: then volumes are made by that job, too.
class Session : public std::enable_shared_from_this<Session>, private JobListener {
 public:
  Session(const Services& services, std::shared_ptr<const ServedModel> model, std::string name, bool named,
          const Limits& limits, SessionOwner owner = {});
  ~Session() override;

  const std::string& name() const { return name_; }
  bool named() const { return named_; }
  /// Address of the client that made it.
  const std::string& owner() const { return owner_.address; }
  const std::shared_ptr<const ServedModel>& model() const { return model_; }

  /// See Control.
  v1::Role join(Member& member, bool heir = false);
  v1::Role rejoin(Member& member, bool control);
  /// With its subscriptions. `may_return`: keeps an unnamed session, and the member's control, for
  /// `linger_seconds`. Throws nothing.
  void leave(Member& member, bool may_return);
  Control& control() { return control_; }
  const Control& control() const { return control_; }
  /// The member asks whoever holds control for it, or asks no more; all who hear of Members hear of that.
  void ask_for_control(Member& member, bool asks);

  /// See SubscriptionTable::add(). Frames follow, the present pose first.
  const Subscription* subscribe(Member& member, const SubscriptionRequest& asked);
  /// False where the member has no such subscription.
  bool unsubscribe(Member& member, std::uint32_t id);
  const SubscriptionTable& subscriptions() const { return table_; }
  /// About the bytes of a frame of it.
  std::uint64_t frame_bytes(const StreamSpec& spec) const { return planner_.frame_bytes(spec); }

  /// From the member that holds control; already checked against the rig. One that crossed a clip's poses on
  /// its way gets the number after theirs.
  void pose(PoseRequest request);
  const PoseSlot& poses() const { return poses_; }
  /// Poses by itself, until the clip ends, a pose comes or everybody has left. All who hear of ClipState hear
  /// how far it is.
  ClipPlayer& player() { return *player_; }

  const runtime::QualityThresholds& thresholds() const { return quality_.thresholds(); }
  void set_thresholds(const runtime::QualityThresholds& thresholds);

  /// How the balls of volumes hang.
  const HungSpheres& hung() const { return hung_; }
  /// A row of Model::spheres hung otherwise, or null: as the model has it. Volumes by it are made again.
  /// False where there is no memory to keep it.
  bool hang(std::size_t row, std::optional<runtime::Hanging> hanging);

  /// See ProbeQueue::ask().
  void probe(ProbeQueue::Ready ready, bool many);
  /// Lets go of what probes need, where none has come of late, or nobody is here.
  void forget_probes(Clock::time_point now);

  SessionRecorder& recorder() { return recorder_; }
  /// Since when a recording runs that no client may end, since none controls the session.
  std::optional<Clock::time_point> abandoned() const;

  /// Makes what had to wait for memory.
  void catch_up();
  /// A member has read something: what had to wait for that is made.
  void has_read();
  /// A client has a frame whole; see QualityTracker.
  void arrived();
  /// The server stops: volumes under way end early, and no more are begun, but those of a recording.
  void stop_volumes() { volumes_.stop(); }
  /// In which the present pose is measured.
  std::shared_ptr<Turn> quality_turn() { return {shared_from_this(), &quality_turn_}; }
  /// In which the present pose is shown to who has not seen it.
  std::shared_ptr<Turn> first_frame_turn() { return {shared_from_this(), &first_frame_turn_}; }

  /// Its model's name means another one now: nobody joins any more, and it ends with its last member.
  void retire(std::uint64_t identity);
  bool retired() const { return retired_; }
  /// Nobody is here, nor may come back.
  bool over(Clock::time_point now) const;
  /// Nobody is here, and only who was may come back: since when.
  std::optional<Clock::time_point> waiting() const;

 private:
  void pose_made(const PoseOutcome& outcome, const Skipped& skipped, const ShownPose& shown) override;
  void probe_made(const std::shared_ptr<ProbeFrame>& frame) override;
  void frame_made(const PosedFrame& frame) override;
  void volumes_made(const Status& status) override;

  std::shared_ptr<JobListener> listener() { return {shared_from_this(), this}; }
  void put(PoseRequest request);
  void log_error(const std::string& what) const;
  void tell_members() const;
  void tell_clip();
  void tell(v1::Feature feature, const v1::Envelope& news) const;
  // session_jobs.cpp
  StreamKinds pose_kinds() const;
  FramePlan plan_present(Clock::time_point now) const;
  bool may_pose() const;
  bool await_next_pose(Clock::time_point now);
  void set_alarm() { alarm_.set(table_.next_due()); }
  void start_jobs();
  void start_pose(Clock::time_point now);
  void start_volumes(Clock::time_point now);
  bool show_newcomers();
  void begin_job(Clock::time_point now, bool background);
  std::shared_ptr<PoseJob> make_job();
  void prepare_probe(PoseJob& job, bool new_pose, Clock::time_point now);
  void submit(const std::shared_ptr<PoseJob>& job, bool new_pose);
  void job_over(const PoseJob& job, const Status& status);
  void end_recorded(bool whole);

  net::io_context& io_;
  Executor& executor_;
  const MemoryBudget& memory_;
  Metrics& metrics_;
  StreamActivity& activity_;
  TurnQueue& quality_turns_;
  TurnQueue& first_frames_;
  Journal* journal_;
  std::shared_ptr<const ServedModel> model_;
  std::string name_;
  bool named_;
  bool retired_ = false;
  Limits limits_;
  SessionOwner owner_;
  std::shared_ptr<Account> account_;

  Control control_;
  PoseSlot poses_;
  SubscriptionTable table_;
  FramePlanner planner_;
  JobPacer pacer_;
  VolumeJobs volumes_;
  ProbeQueue probes_;
  QualityTracker quality_;
  HungSpheres hung_;
  SessionRecorder recorder_;
  std::shared_ptr<ClipPlayer> player_;
  std::uint64_t clip_sequence_ = 0;  ///< of the newest pose that a clip showed
  Presence presence_;
  ChangeNotifier members_news_, clip_news_;
  Alarm alarm_;  ///< for who is due
  Turn quality_turn_, first_frame_turn_;
  std::uint64_t frames_ = 0;
  bool volumes_with_pose_ = false;  ///< the job under way makes volumes, too
};

}  // namespace ecorche::server
