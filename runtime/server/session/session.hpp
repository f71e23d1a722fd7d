// SPDX-License-Identifier: Apache-2.0
// One posed body and those who watch it.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <ecorche/runtime/pose_quality.hpp>
#include "runtime/server/resources/memory_budget.hpp"
#include "runtime/server/resources/metrics.hpp"
#include "runtime/server/resources/options.hpp"
#include "runtime/server/schedule/stream_activity.hpp"
#include "runtime/server/schedule/turn_queue.hpp"
#include "runtime/server/schedule/workers.hpp"
#include "runtime/server/session/clip.hpp"
#include "runtime/server/session/pose_job.hpp"
#include "runtime/server/session/recording.hpp"

namespace ecorche::server {

class Journal;
struct QualityJob;

/// Poses overtaken by newer ones since the last that was taken up.
struct Skipped {
  static constexpr std::size_t most_told = 256;
  std::uint64_t count = 0;
  std::deque<std::uint64_t> newest;  ///< sequence numbers, oldest first

  void add(std::uint64_t sequence);
};

/// A connection, as its session sees it. Called on the I/O thread. Nothing here throws, nor joins or leaves a
/// session before it has returned.
class Member {
 public:
  virtual ~Member() = default;
  /// False where the member has not got the keyframe that the frame is against, and so not the frame either.
  virtual bool deliver(const PosedFrame& frame) = 0;
  /// The level of detail that suits the member's way for its next frame; `still`: nothing newer waits.
  virtual std::uint32_t ask_level(std::uint32_t subscription, std::uint32_t finest, std::uint32_t coarsest,
                                  bool still) = 0;
  /// Only to the member that holds control.
  virtual void pose_done(const PoseOutcome& outcome, const Skipped& skipped) = 0;
  /// `vacant`: control is free; else, for so many seconds above 0, only its last holder may have it.
  virtual void control_changed(v1::Role role, bool vacant, double reserved_seconds) = 0;
  /// The model of this name is another one now; the session goes on with the old one.
  virtual void model_changed(std::uint64_t identity) = 0;
  /// Whether a frame of so many bytes of the subscription is worth making: false while what it was sent
  /// before waits for the member to read, and fills its share.
  virtual bool may_take(std::uint32_t subscription, std::uint64_t bytes) {
    static_cast<void>(subscription), static_cast<void>(bytes);
    return true;
  }
  /// Its part of what all keep; null: it has no share of its own.
  virtual std::shared_ptr<const Pool> kept_share() const { return nullptr; }
};

/// A subscription as a member asked for it.
struct SubscriptionRequest {
  std::uint32_t id = 0;
  StreamSpec spec;
  v1::Subscribe request;
  std::vector<std::shared_ptr<MeshStream>> streams = {};  ///< of a mesh, where they are made already
};

/// What all sessions of a server share.
struct Services {
  net::io_context& io;
  Workers& workers;
  Workers& volume_workers;  ///< give way to those
  Workers& plane_workers;   ///< as well; planes do not wait behind other sessions' volumes
  const MemoryBudget& memory;
  TurnQueue& quality_turns;  ///< whose present pose is measured next
  TurnQueue& first_frames;   ///< whose newcomers are shown the present pose next, beside streams
  StreamActivity& activity;
  Metrics& metrics;
  /// Has something large destroyed elsewhere than on the I/O thread, which giving back hundreds of MiB would
  /// keep for longer than a frame. Throws nothing.
  std::function<void(std::shared_ptr<const void>)> destroy_later;
  Journal* journal = nullptr;  ///< for what goes wrong; may be null
};

/// Lives on the I/O thread. Poses wait in one slot, where the newest wins; one job at a time runs on the
/// workers until its end is posted back. Volumes, which take longer than all else of a pose, have a job of
/// their own beside it, and planes of them another: each shows the newest pose that is posed when it begins,
/// so that meshes never wait for a volume. Only what is recorded keeps together.
class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(const Services& services, std::shared_ptr<const ServedModel> model, std::string name, bool named,
          const Limits& limits);
  ~Session();

  const std::string& name() const { return name_; }
  bool named() const { return named_; }
  /// Whose it is: the address of the client that made it, the part of what all keep that is for it, and on
  /// whose account jobs are done.
  void belong(const std::string& address, std::shared_ptr<const Pool> kept, std::shared_ptr<Account> of) {
    owner_ = address;
    kept_ = std::move(kept);
    account_ = std::make_shared<Account>(std::move(of));
  }
  const std::string& owner() const { return owner_; }
  const std::shared_ptr<Account>& account() const { return account_; }
  const std::shared_ptr<const ServedModel>& model() const { return model_; }

  /// Gives control to the member where it is free; to an `heir` also where it is kept for one. The others are
  /// told.
  v1::Role join(Member& member, bool heir = false);
  /// As join; with `control`, the control that it left with is its again, unless somebody has it.
  v1::Role rejoin(Member& member, bool control);
  /// `may_return`: keeps an unnamed session, and the member's control, for `linger_seconds`. Throws nothing.
  void leave(Member& member, bool may_return);
  /// Control is kept for `linger_seconds` for who held it in the session of this name before (join's heir).
  void await_heir();
  /// Somebody holds control, or it is kept for somebody.
  bool controlled() const { return controller_ != nullptr || reserved(Clock::now()); }
  /// Tells all once control is free that was kept.
  void free_control(Clock::time_point now);

  /// False while another holds control or may come back to it.
  bool claim(Member& member);
  /// False where the member does not hold it.
  bool release(Member& member);
  bool controls(const Member& member) const { return controller_ == &member; }

  /// The subscription, the same for equal specs, of number `asked.id` where that is not 0 and the spec is
  /// new; good until the next call. Frames follow, the present pose first. Null where what its streams keep
  /// has no room.
  const Subscription* subscribe(Member& member, const SubscriptionRequest& asked);
  /// About the bytes of a frame of it.
  std::uint64_t frame_bytes(const StreamSpec& spec) const;
  std::vector<SubscriptionRequest> requests_of(Member& member) const;
  /// Somebody has such a subscription.
  bool shows(const StreamSpec& spec) const;
  /// False where the member has no such subscription.
  bool unsubscribe(Member& member, std::uint32_t id);

  /// From the member that holds control; already checked against the rig.
  void pose(PoseRequest request);
  /// The pose that is shown.
  const PoseRequest& present() const { return present_; }
  /// Of the newest pose, shown or not.
  std::uint64_t last_sequence() const { return last_sequence_; }

  /// Poses by itself, until the clip ends, a pose comes or everybody has left.
  void play(std::shared_ptr<const Clip> clip, double speed, bool loop);
  void stop_clip() { player_->stop(); }

  const runtime::QualityThresholds& thresholds() const { return thresholds_; }
  void set_thresholds(const runtime::QualityThresholds& thresholds);

  /// Calls `ready` with the posed body, at once where it is at hand, or with null and the reason. As long as
  /// somebody asks every second, every pose is made ready: all of it where `many` points are asked.
  using Ready = std::function<void(const std::shared_ptr<const ProbeFrame>&, const Status&)>;
  void probe(Ready ready, bool many);

  /// The poses that are taken up from now on go into it, with their frames, until it is taken away.
  void record(std::shared_ptr<Recording> recording) { recording_ = std::move(recording); }
  /// Takes it away; `ended` is called once the pose that is being shown has all its frames in it.
  void end_recording(std::function<void()> ended);
  const std::shared_ptr<Recording>& recording() const { return recording_; }
  /// Since when a recording runs that no client may end, since none controls the session.
  std::optional<Clock::time_point> abandoned() const;

  /// Makes what had to wait for memory.
  void catch_up();
  /// A member has read something: what had to wait for that is made.
  void has_read() {
    if (std::exchange(unread_, false)) start_jobs();
  }
  /// Lets go of what probes need, where none has come for ten seconds, or nobody is here.
  void forget_probes(Clock::time_point now);
  /// The server stops: volumes under way end early, and no more are begun, but those of a recording.
  void stop_volumes();
  /// A client has a frame whole. The pose is judged now, if it is to be: where cores are shared with clients,
  /// not while they read.
  void arrived();
  /// In which the present pose is judged.
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
  struct Row {
    Subscription subscription;
    v1::Subscribe request;
    std::set<Member*> members;
    std::optional<Clock::time_point> last_keyframe;  ///< when the last one was made that somebody lacked
    Clock::time_point next_due{};                    ///< of max_rate
    std::optional<Clock::time_point> refresh_at;     ///< when the present pose is to be shown (again)
    std::optional<Clock::time_point> fresh;          ///< since when somebody waits for the present pose
    bool shown = false;                              ///< somebody had a frame of it
    MemoryBudget::Reservation kept;                  ///< what its streams keep
    bool is_volume() const { return subscription.volume != nullptr; }
  };

  /// Jobs of one kind: one at a time, and no more in a second than poses may come.
  struct Lane {
    Lane(net::io_context& io, Workers& by) : workers(by), pace(io) {}
    Workers& workers;
    bool busy = false;
    Clock::time_point next = Clock::now();  ///< no job begins before
    net::steady_timer pace;
    bool pacing = false;                      ///< it runs
    std::stop_source stop{std::nostopstate};  ///< of the job, where it makes volumes
  };

  /// What rows are taken up for.
  struct FramePlan {
    Clock::time_point now;
    bool refresh = false;     ///< the present pose, for who has not seen it
    bool still = false;       ///< the body stands still
    std::uint64_t bytes = 0;  ///< of the frames, about
  };

  /// The pose under way, where it is recorded.
  struct Recorded {
    std::shared_ptr<Recording> recording;             ///< null: it is not
    std::map<std::uint32_t, v1::Subscribe> requests;  ///< of its frames, by subscription
    std::uint64_t job = 0;                            ///< PoseJob::number, once the pose is in the recording
    std::function<void()> ended;                      ///< the recording ends with this pose
  };

  class JobReporter;
  void complain(const std::string& what) const;
  bool reserved(Clock::time_point now) const;
  void take_control(Member& member);
  void tell_control(const Member* but = nullptr);
  bool measure_quality();
  bool show_newcomers();
  void judged(const QualityJob& job);
  std::shared_ptr<const v1::PoseQuality> known_quality(const MeshSpec& spec, bool refresh) const;
  void drop(Row& row) const;
  std::shared_ptr<ProbeFrame> spare_probe();
  void probe_ready(const std::shared_ptr<ProbeFrame>& frame, const Status& status = {});
  void take(PoseRequest request);
  void start_jobs();
  bool too_early(Lane& lane, Clock::time_point now);
  bool by_pose(const Row& row) const;
  bool anybody_waits();
  bool anybody_reads(const Row& row, std::uint64_t before);
  bool has_room(const Row& row, std::uint64_t before);
  void start_pose();
  void start(Clock::time_point now, bool aside);
  bool soon_posed(Clock::time_point now);
  void submit(std::shared_ptr<PoseJob> job, bool refresh);
  void posed(const PoseJob& job, const Status& status);
  void begin(PoseJob& job);
  void take_up(PoseJob& job);
  void take_up_probes(PoseJob& job, bool refresh);
  void take_up(Row& row, FramePlan& taking, PoseJob& job);
  // session_recording.cpp
  void begin_recorded();
  void record_pose(const PoseJob& job);
  void record_frame(const PosedFrame& frame);
  void end_recorded(bool whole);
  // session_volumes.cpp
  bool together() const { return recording_ != nullptr; }
  bool volumes_busy() const { return whole_.busy || planes_.busy; }
  void set_volumes_busy(bool busy) { whole_.busy = planes_.busy = busy; }
  Lane& lane_of(const VolumeSpec& spec) { return spec.slices.empty() ? whole_ : planes_; }
  void want_volumes();
  void want_again(const Lane& lane);
  void stop_unwatched();
  void start_volumes(Lane& lane);
  void submit_volumes(Lane& lane, Workers& workers, std::shared_ptr<PoseJob> job);
  void volumes_done(Lane& lane, bool posed, const Status& status);
  bool held_back(Row& row, Clock::time_point now) const;
  void ask_levels(Row& row, bool still, Clock::time_point now) const;
  void put_off_keyframes(Clock::time_point now);
  bool rests(Clock::time_point now) const;
  void keep_time();
  void finish_pose(const PoseOutcome& outcome, const Skipped& skipped, const PoseJob& job, bool refresh);
  void publish(const PosedFrame& frame);

  net::io_context& io_;
  Metrics& metrics_;
  const MemoryBudget& memory_;
  TurnQueue& quality_turns_;
  TurnQueue& first_frames_;
  StreamActivity& activity_;
  std::function<void(std::shared_ptr<const void>)> destroy_later_;
  Journal* journal_;
  std::shared_ptr<const ServedModel> model_;
  std::string name_, owner_;
  bool named_;
  Limits limits_;
  std::shared_ptr<const Pool> kept_;  ///< for what is no subscription's
  std::shared_ptr<Account> account_ = std::make_shared<Account>();
  Turn quality_turn_, first_frame_turn_;

  std::set<Member*> members_;
  Member* controller_ = nullptr;
  std::optional<Clock::time_point> control_left_;  ///< when the last controller went, who may return
  bool awaits_heir_ = false;                       ///< it went from the session that was before
  Clock::time_point uncontrolled_{};               ///< since when nobody controls it
  Clock::time_point last_seen_ = Clock::now();     ///< when the last member went

  bool awaited_ = false;  ///< the last one may come back
  bool retired_ = false;
  bool stopping_ = false;
  bool unjudged_ = false;  ///< the present pose, once it has arrived somewhere

  std::vector<Row> rows_;
  std::uint32_t last_subscription_ = 0;

  std::optional<PoseRequest> slot_;
  Skipped skipped_;
  PoseRequest present_;
  std::uint64_t frames_ = 0;
  Lane poses_, whole_, planes_;  ///< meshes and probes; volumes; planes of volumes
  net::steady_timer clock_;      ///< for the rows' refresh_at
  std::optional<Clock::time_point> clock_at_;
  Clock::time_point posed_{};    ///< when the last pose was taken up
  Clock::time_point stirred_{};  ///< when the last pose came, or the last job ended
  bool rested_ = false;          ///< the waiting pose came after a rest
  bool unread_ = false;          ///< something waits until a member has read
  Clock::time_point moved_{};    ///< when the pose last became another one

  std::uint64_t last_sequence_ = 0;
  std::shared_ptr<ClipPlayer> player_;
  runtime::QualityThresholds thresholds_;
  std::shared_ptr<Recording> recording_;
  Recorded recorded_;
  std::vector<std::shared_ptr<ProbeFrame>> probe_frames_;  ///< to be filled again once nobody asks them
  std::shared_ptr<const ProbeFrame> probe_frame_;          ///< of the pose that is shown
  std::vector<Ready> probes_;                              ///< wait for one
  std::optional<Clock::time_point> probed_, probed_many_;
};

}  // namespace ecorche::server
