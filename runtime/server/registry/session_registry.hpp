// SPDX-License-Identifier: Apache-2.0
// What all connections of a server share; lives on the I/O thread.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/server/registry/named_model.hpp"
#include "runtime/server/registry/recordings.hpp"
#include "runtime/server/registry/test_hooks.hpp"
#include "runtime/server/resources/journal.hpp"
#include "runtime/server/resources/memory_budget.hpp"
#include "runtime/server/resources/metrics.hpp"
#include "runtime/server/schedule/executor.hpp"
#include "runtime/server/schedule/stream_activity.hpp"
#include "runtime/server/schedule/turn_queue.hpp"
#include "runtime/server/session/session.hpp"

namespace ecorche::server {

/// The place that a connection left.
struct SavedPlace {
  std::weak_ptr<Session> session;
  std::vector<SubscriptionRequest> subscriptions;
  bool controlled = false;
  bool watches = false;  ///< it wanted no control
  Clock::time_point since = Clock::now();
};

class SessionRegistry {
 public:
  SessionRegistry(net::io_context& io, Workers& workers, Options options, std::vector<NamedModel> models,
                  TestHooks hooks);
  ~SessionRegistry();
  SessionRegistry(const SessionRegistry&) = delete;
  SessionRegistry& operator=(const SessionRegistry&) = delete;

  const Options& options() const { return options_; }
  const Limits& limits() const { return options_.limits; }
  Passes& passes() { return *passes_; }
  std::shared_ptr<const Passes> shared_passes() const { return passes_; }
  /// Reads the passes again, and calls `done` on the I/O thread; false: they stay as they were, as the log
  /// says.
  void reload_passes(std::function<void(bool)> done);
  const std::vector<std::shared_ptr<const ServedModel>>& models() const { return models_; }

  /// The session that the request names, made where it is new, for a client of this address. not_found for an
  /// unknown model, invalid_argument for an odd name, failed_precondition for a session of another model,
  /// resource_exhausted for one session too many, of all or of the address.
  Status open(const v1::OpenModel& request, const std::string& address, std::shared_ptr<Session>& out);
  /// What clients of one address have together.
  struct ClientShare {
    std::shared_ptr<const Pool> kept;  ///< a part of what all keep
    std::shared_ptr<Account> account;
  };
  std::shared_ptr<const ClientShare> share_of(const std::string& address);

  /// Of a new connection, counted from 1.
  std::uint64_t next_connection() { return ++connections_seen_; }
  /// A connection with this resume token is there; `give_up` ends it for another that shows the token.
  void arrived(const std::string& token, std::function<void()> give_up);
  /// It ended; a place that can be taken up again is kept for `linger_seconds`, as many as there may be
  /// connections: then the oldest is lost.
  /// Throws nothing: where there is no memory for a place, it is lost.
  void left(const std::string& token, std::optional<SavedPlace> place) noexcept;
  /// The place of the token, which its connection leaves where it is still there; good until the next call.
  /// Null where there is none (any more).
  const SavedPlace* find_place(const std::string& token);
  /// Somebody has it.
  void forget(const std::string& token) noexcept { places_.erase(token); }

  /// What can be played on the model.
  std::vector<std::shared_ptr<const Clip>> clips_for(const ServedModel& model) const;
  Recordings& recordings() { return recordings_; }
  /// Ends those of all sessions, whose end is the server's.
  void end_recordings();
  /// Reads a model again, in the background, and calls `done` on the I/O thread.
  void reload(const std::string& name, std::function<void(const Status&)> done);
  /// All of them, one after the other, then `done`; the log tells how each went. While any is being read it
  /// waits: what is read may be older than the wish.
  void reload_all(std::function<void()> done);

  Executor& executor() { return executor_; }
  Metrics& metrics() { return metrics_; }
  Journal& journal() { return journal_; }
  const MemoryBudget& memory() const { return memory_; }
  /// Frames fill half of the memory for them, or did within the time that a stalled client has: else the
  /// first to be dropped would save the others, and they would keep theirs.
  bool crowded(Clock::time_point now);
  /// See StreamActivity.
  std::optional<Clock::duration> patience(Clock::time_point now) const { return activity_.patience(now); }
  const TestHooks& hooks() const { return hooks_; }
  /// Waits for the timer.
  net::awaitable<void> wait(net::steady_timer& timer, boost::system::error_code& ec);

  /// Nothing is made or judged beside the stream any more; volumes under way end early.
  void stop();

  std::size_t sessions() const { return sessions_.size() + retired_.size(); }
  /// Ends the sessions that are over, and lets those go on that waited for memory.
  void sweep(Clock::time_point now);

 private:
  void prepare_details(std::shared_ptr<const ServedModel> model, std::uint32_t tissue = 0);
  void replace(std::shared_ptr<const ServedModel> model);
  void reload_from(std::size_t row, std::function<void()> done);
  bool evict(const std::string& address = {});
  void tidy_up() noexcept;

  net::io_context& io_;
  Options options_;
  std::shared_ptr<Passes> passes_;
  MemoryBudget memory_;
  TestHooks hooks_;
  std::atomic<bool> leaving_ = false;  ///< nothing more is made before somebody asks
  std::vector<std::shared_ptr<const ServedModel>> models_;
  Executor executor_;  ///< its threads read what is above, and end before
  TurnQueue quality_turns_, first_frames_;
  StreamActivity activity_;
  std::map<std::string, std::function<ModelParts()>> sources_;
  bool reloading_ = false;
  std::vector<std::function<void()>> reload_again_;  ///< for all, once that is over: what to call then
  std::map<std::string, std::function<void()>> live_;
  std::map<std::string, SavedPlace> places_;
  std::vector<std::shared_ptr<Session>> retired_;
  Recordings recordings_;
  Metrics metrics_;
  Journal journal_;
  std::map<std::string, std::shared_ptr<Session>> sessions_;
  std::uint64_t connections_seen_ = 0;
  std::map<std::string, std::shared_ptr<const ClientShare>> client_shares_;  ///< by address
  std::optional<Clock::time_point> crowded_;                                 ///< when it was last
};

}  // namespace ecorche::server
