// SPDX-License-Identifier: Apache-2.0
// Which frames a job makes.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "runtime/server/resources/memory_budget.hpp"
#include "runtime/server/schedule/stream_activity.hpp"
#include "runtime/server/session/pose_job.hpp"
#include "runtime/server/session/served_model.hpp"
#include "runtime/server/session/subscription_table.hpp"

namespace ecorche::server {

/// What frames are made of.
struct FramePlan {
  enum class Shows : std::uint8_t {
    next,     ///< the next pose, to all who are due
    present,  ///< the present pose, to who waits for it
    newest,   ///< the present pose, to who waits for it, and has seen as many as could be made
  };
  Clock::time_point now;
  StreamKinds kinds = 0;  ///< that the job makes
  Shows shows = Shows::next;
  bool still = false;              ///< nothing newer comes: members see all of it, once it is sure
  Clock::time_point moved{};       ///< when the pose last became another one
  bool keyframes_at_once = false;  ///< the distance of keyframes is kept already
  std::uint64_t present = 0;       ///< sequence number of the pose that is shown
};

/// Chooses rows of a table: those that are due, whose members read, and for whose frames there is memory. On
/// the I/O thread.
class FramePlanner {
 public:
  FramePlanner(SubscriptionTable& table, std::shared_ptr<const ServedModel> model, const MemoryBudget& memory,
               StreamActivity& activity, std::uint64_t most_voxels);

  /// About the bytes of a frame that holds everything; of a volume that is too large nothing is made.
  std::uint64_t frame_bytes(const StreamSpec& spec) const;

  /// Whether fill() would find something; not for Shows::next, which is for everybody.
  bool anything(const FramePlan& plan);
  /// Fills subscriptions and reservation of `job`, of which all else is set but, for Shows::next, the
  /// request; of Shows::newest, its request came when the first began to wait. The bytes of the frames,
  /// about.
  std::uint64_t fill(const FramePlan& plan, PoseJob& job);

  /// Whether something waits until a member has read; asked, it is forgotten.
  bool take_unread() { return std::exchange(unread_, false); }

 private:
  bool selects(const FramePlan& plan, SubscriptionRow& row, std::uint64_t before);
  bool anybody_reads(const SubscriptionRow& row, std::uint64_t before);
  bool fits(const SubscriptionRow& row, std::uint64_t before, Clock::time_point now);
  void add(const FramePlan& plan, SubscriptionRow& row, PoseJob& job) const;
  std::shared_ptr<const v1::PoseQuality> known_quality(const MeshSpec& spec, const FramePlan& plan,
                                                       const PoseJob& job) const;

  SubscriptionTable& table_;
  std::shared_ptr<const ServedModel> model_;
  const MemoryBudget& memory_;
  StreamActivity& activity_;
  std::uint64_t most_voxels_;
  bool unread_ = false;
};

}  // namespace ecorche::server
