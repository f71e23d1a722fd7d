// SPDX-License-Identifier: Apache-2.0
// All recordings of a server: who may begin one, how they reach the disk, and what can be played of them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "runtime/server/resources/options.hpp"
#include "runtime/server/resources/rates.hpp"
#include "runtime/server/schedule/executor.hpp"
#include "runtime/server/session/session.hpp"

namespace ecorche::server {

/// On the I/O thread; Service::files writes.
///
/// The limits are there so that no client keeps the others from recording: of what runs at once and of the
/// folder's files one address has its share (Limits::peer_share) and begins so many a minute
/// (Limits::recordings_per_minute, four in one go). One without a pose leaves no file, one whose client has
/// gone ends two seconds later, and where the folder is full, what is older than Limits::recording_days makes
/// way.
class Recordings {
 public:
  /// After so long without the client that began it, a recording ends.
  static constexpr std::chrono::seconds abandoned_after{2};
  /// What is recorded reaches the disk so often.
  static constexpr std::chrono::milliseconds written_every{500};

  Recordings(Executor& executor, const Options& options);

  /// This server keeps recordings; else none may begin.
  bool enabled() const { return !options_.record_folder.empty(); }
  /// Begins one in the session, which has none, for a client of this address. invalid_argument for an odd
  /// name, already_exists for one that is taken, resource_exhausted for one too many.
  Status begin(Session& session, const std::string& name, const std::string& address);
  /// Ends the session's recording, which it has, with its last pose; then `done`, with how it reached the
  /// disk. failed_precondition where no pose came.
  void finish(Session& session, std::function<void(const Status&)> done);
  /// As above, for one that nobody ended.
  void keep(Session& session);
  /// What came reaches the disk, every now and then.
  void tick(Clock::time_point now);

  /// What was recorded with models of this rig, and can be played: the newest 16, of all rigs together no
  /// more than Limits::record_bytes.
  std::vector<std::shared_ptr<const Clip>> clips(std::uint64_t rig_digest) const;

 private:
  struct Ended;
  struct Playable {
    std::uint64_t rig_digest;
    std::shared_ptr<const Clip> clip;
    std::uint64_t bytes;
  };
  Status check(const std::string& name, const std::string& address, std::filesystem::path& path);
  Status check_folder(const std::string& address);
  std::size_t evict() const;
  void write_pending(Recording& recording);
  void write(const std::shared_ptr<Recording>& recording, const ServedModel& model,
             std::function<void(const Status&)> done);
  void add(std::uint64_t rig_digest, Clip clip);

  Executor& executor_;
  const Options& options_;
  Rates begun_;                                    ///< by address
  std::vector<std::weak_ptr<Recording>> running_;  ///< or wait for their last frames, or are being written
  std::map<std::string, std::vector<std::filesystem::path>> files_;  ///< that were begun, by address
  std::vector<Playable> playable_;
  Clock::time_point written_{};
};

}  // namespace ecorche::server
