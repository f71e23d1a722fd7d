// SPDX-License-Identifier: Apache-2.0
// Who sees what of a session, and when each is due.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "runtime/server/net/asio.hpp"
#include "runtime/server/resources/memory_budget.hpp"
#include "runtime/server/schedule/destroy_later.hpp"
#include "runtime/server/session/member.hpp"
#include "runtime/server/session/pose_job.hpp"
#include "runtime/server/session/served_model.hpp"
#include "runtime/server/session/subscription.hpp"

namespace ecorche::server {

/// Kinds of streams, one bit each.
using StreamKinds = unsigned;
inline constexpr StreamKinds kMeshes = 1, kVolumes = 2, kPlanes = 4;  ///< planes: of volumes
StreamKinds kind_of(const StreamSpec& spec);

/// A subscription as a member asked for it.
struct SubscriptionRequest {
  std::uint32_t id = 0;
  StreamSpec spec;
  v1::Subscribe request;
  std::vector<std::shared_ptr<MeshStream>> streams = {};  ///< of a mesh, where they are made already
};

/// A subscription, and those who share it.
struct SubscriptionRow {
  /// Between keyframes that laggards ask for: one must not make everybody's frames three times as large.
  static constexpr std::chrono::milliseconds keyframe_pause{100};

  Subscription subscription;
  v1::Subscribe request;
  std::set<Member*> members;
  MemoryBudget::Reservation kept;                  ///< what its streams keep
  bool shown = false;                              ///< somebody had a frame of it
  std::optional<Clock::time_point> waiting_since;  ///< somebody waits for the present pose
  std::optional<Clock::time_point> refresh_at;     ///< when the present pose is to be shown (again)
  Clock::time_point next_due{};                    ///< of max_rate
  std::optional<Clock::time_point> last_keyframe;  ///< when the last one was made that somebody lacked

  StreamKinds kind() const { return kind_of(subscription.spec); }
  /// Null: of a volume.
  const MeshSpec* mesh() const { return std::get_if<MeshSpec>(&subscription.spec); }

  void wait(Clock::time_point since) { waiting_since = waiting_since.value_or(since); }
  /// Too early for its rate; it is served when it is due.
  bool held_back(Clock::time_point now);
  /// Keyframes that are to be made with a frame that shows it now: all that somebody lacks, or, too soon
  /// after the last, none, and those later. `at_once`: none is too soon.
  std::uint32_t take_keyframes(Clock::time_point now, bool at_once);
  /// It has a frame made now.
  void begin_frame(Clock::time_point now);
};

/// Equal specs share one row. Plain bookkeeping; every time comes from the caller.
class SubscriptionTable {
 public:
  /// `kept`: what streams keep is counted there, where their member has no share of its own. `most_voxels`:
  /// of what has more nothing is made.
  SubscriptionTable(std::shared_ptr<const ServedModel> model, std::shared_ptr<const Pool> kept,
                    std::uint64_t most_voxels, DestroyLater destroy_later);

  /// The subscription, of number `asked.id` where that is not 0 and the spec is new; good until the next
  /// call. The member waits for the present pose. Null where what its streams keep has no room.
  const Subscription* add(Member& member, const SubscriptionRequest& asked, Clock::time_point now);
  /// False where the member has no such subscription.
  bool remove(Member& member, std::uint32_t id);
  /// All of the member's. Throws nothing.
  void remove(Member& member);

  std::vector<SubscriptionRow>& rows() { return rows_; }
  const std::vector<SubscriptionRow>& rows() const { return rows_; }
  /// Null where there is none (any more).
  SubscriptionRow* find(std::uint32_t id);
  std::vector<SubscriptionRequest> requests_of(Member& member) const;
  /// What was asked for, by number.
  std::map<std::uint32_t, v1::Subscribe> requests() const;
  /// Somebody has such a subscription.
  bool shows(const StreamSpec& spec) const;
  /// Somebody has one of these kinds.
  bool shows(StreamKinds kinds) const;

  /// Somebody waits for the present pose.
  bool anybody_waits() const;
  /// Who has one of these kinds waits from now on; `paced`: but for whom it is too early.
  void wait(StreamKinds kinds, Clock::time_point now, Clock::time_point since, bool paced);
  /// Who waits for one of these kinds, and is due at no other time, waits until then.
  void put_off(StreamKinds kinds, Clock::time_point until);
  /// While the body moves, keyframes that somebody lacks keep their distance: who comes and goes all the time
  /// must not have everybody sent every pose twice.
  void put_off_keyframes(StreamKinds kinds, Clock::time_point now);
  /// When somebody is due next who does not wait yet.
  std::optional<Clock::time_point> next_due() const;
  /// Who is due waits.
  void wake(Clock::time_point now);

  /// To everybody who shares its subscription; who cannot read it gets a keyframe with the next pose, or,
  /// where none comes, of the present one.
  void deliver(SubscriptionRow& row, const PosedFrame& frame, Clock::time_point now);

 private:
  void drop(SubscriptionRow& row) const;

  std::shared_ptr<const ServedModel> model_;
  std::shared_ptr<const Pool> kept_;
  std::uint64_t most_voxels_;
  DestroyLater destroy_later_;
  std::vector<SubscriptionRow> rows_;
  std::uint32_t last_id_ = 0;
};

}  // namespace ecorche::server
