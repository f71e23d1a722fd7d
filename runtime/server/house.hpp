// SPDX-License-Identifier: Apache-2.0
// What all connections of a server share; lives on the I/O thread.
#pragma once

#include <atomic>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/server/frame_memory.hpp"
#include "runtime/server/judging.hpp"
#include "runtime/server/metrics.hpp"
#include "runtime/server/named_model.hpp"
#include "runtime/server/openings.hpp"
#include "runtime/server/seams.hpp"
#include "runtime/server/session.hpp"
#include "runtime/server/volume_workers.hpp"
#include "runtime/server/workers.hpp"

namespace ecorche::server {

/// The place that a connection left.
struct Lost {
  std::weak_ptr<Session> session;
  std::vector<Asked> asked;
  bool controlled = false;
  Clock::time_point since = Clock::now();
};

class House {
 public:
  House(net::io_context& io, Workers& workers, Options options, std::vector<NamedModel> models, Seams seams);
  ~House();
  House(const House&) = delete;
  House& operator=(const House&) = delete;

  const Options& options() const { return options_; }
  const Limits& limits() const { return options_.limits; }
  const std::vector<std::shared_ptr<const ServedModel>>& models() const { return models_; }

  /// The session that the request names, made where it is new. not_found for an unknown model,
  /// invalid_argument for an odd name, failed_precondition for a session of another model, resource_exhausted
  /// for one session too many.
  Status open(const v1::OpenModel& request, std::shared_ptr<Session>& out);

  /// A connection with this resume token is there; `give_up` ends it for another that shows the token.
  void arrived(const std::string& token, std::function<void()> give_up);
  /// It ended; a place that can be taken up again is kept for `linger_seconds`, as many as there may be
  /// connections: then the oldest is lost.
  void left(const std::string& token, std::optional<Lost> place);
  /// The place of the token, which its connection leaves where it is still there; good until the next call.
  /// Null where there is none (any more).
  const Lost* place_of(const std::string& token);
  /// Somebody has it.
  void forget(const std::string& token) noexcept { lost_.erase(token); }

  /// What can be played on the model.
  std::vector<std::shared_ptr<const Clip>> clips_for(const ServedModel& model) const;
  /// What was recorded with models of this rig is a clip, too.
  void add_clip(std::uint64_t rig_digest, Clip clip);
  /// Where a recording of this name goes: invalid_argument, failed_precondition, already_exists.
  Status recording_path(const std::string& name, std::filesystem::path& out) const;
  /// Ends the session's recording, which it has, with its last pose, and writes it; then `done`.
  void finish_recording(Session& session, std::function<void(const Status&)> done);
  /// As finish_recording, for all sessions, whose end is the server's.
  void end_recordings();
  /// resource_exhausted where four run, or the folder holds 256 files; already_exists where one of this name
  /// runs, or ends.
  Status room_for_recording(const std::string& name) const;

  /// Reads a model again, aside, and calls `done` on the I/O thread.
  void reload(const std::string& name, std::function<void(const Status&)> done);

  /// `work` on a worker, then `then` on the I/O thread. Neither may throw. One worker is left for poses
  /// (where there are two): what else is asked, however much, waits for the others.
  void offload(std::function<void()> work, std::function<void()> then);
  /// As offload, but on one thread that gives way to all others.
  void set_aside(std::function<void()> work, std::function<void()> then);

  /// Lets go of what a client had to be sent, on that thread: giving back a GiB takes longer than a frame.
  void let_go(std::shared_ptr<const void> what) noexcept;

  Metrics& metrics() { return metrics_; }
  const FrameMemory& memory() const { return memory_; }
  /// Frames fill half of the memory for them, or did within the time that a stalled client has: else the
  /// first to be dropped would save the others, and they would keep theirs.
  bool crowded(Clock::time_point now);
  const Seams& seams() const { return seams_; }
  /// Waits for the timer.
  net::awaitable<void> wait(net::steady_timer& timer, boost::system::error_code& ec);

  /// Nothing is made or judged beside the stream any more; volumes under way end early.
  void stop();

  std::size_t sessions() const { return sessions_.size() + retired_.size(); }
  /// Ends the sessions that are over, and lets those go on that waited for memory.
  void sweep(Clock::time_point now);

 private:
  net::io_context& io_;
  Workers& workers_;
  void hand_over(Workers& to, std::function<void()> work, std::function<void()> then);
  void offer();
  void coarsen(std::shared_ptr<const ServedModel> model, std::uint32_t tissue = 0);
  void replace(std::shared_ptr<const ServedModel> model);
  bool make_room();
  void keep_recording(Session& session);
  void write(const std::shared_ptr<Recording>& recording, const std::filesystem::path& path,
             std::uint64_t rig_digest, const std::function<void(const Status&)>& done);

  Options options_;
  FrameMemory memory_;
  Judging judging_;
  Openings openings_;
  std::vector<std::shared_ptr<const ServedModel>> models_;
  std::map<std::string, std::function<ModelParts()>> sources_;
  bool reloading_ = false;
  std::map<std::string, std::function<void()>> live_;
  std::map<std::string, Lost> lost_;
  std::vector<std::shared_ptr<Session>> retired_;
  std::map<std::uint64_t, std::vector<std::shared_ptr<const Clip>>> recorded_;  // by rig digest
  std::vector<std::weak_ptr<const Recording>> ending_;  ///< wait for their last frames, or are being written
  Seams seams_;
  Metrics metrics_;
  std::map<std::string, std::shared_ptr<Session>> sessions_;
  std::uint64_t unnamed_ = 0;
  std::optional<Clock::time_point> crowded_;                                    ///< when it was last
  std::deque<std::pair<std::function<void()>, std::function<void()>>> offers_;  ///< wait for a worker
  std::size_t offloaded_ = 0;                                                   ///< have one
  std::atomic<bool> leaving_ = false;  ///< no more levels of detail are made before somebody asks
  Workers aside_;
  VolumeWorkers volumes_, planes_;
};

}  // namespace ecorche::server
