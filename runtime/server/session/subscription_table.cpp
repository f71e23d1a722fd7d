// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/subscription_table.hpp"

#include <algorithm>
#include <utility>

#include "runtime/server/session/mesh_streams.hpp"
#include "runtime/server/session/retained_bytes.hpp"
#include "runtime/server/session/volume_stream.hpp"

namespace ecorche::server {
namespace {

// Seconds between frames of the slowest rate.
constexpr double kLongest = 24 * 3600;

double rate_of(const StreamSpec& spec) {
  return std::visit([](const auto& one) { return one.max_rate; }, spec);
}

}  // namespace

StreamKinds kind_of(const StreamSpec& spec) {
  const auto* volume = std::get_if<VolumeSpec>(&spec);
  if (!volume) return kMeshes;
  return volume->slices.empty() ? kVolumes : kPlanes;
}

bool SubscriptionRow::held_back(Clock::time_point now) {
  if (rate_of(subscription.spec) == 0 || now >= next_due) return false;
  refresh_at = next_due;
  return true;
}

std::uint32_t SubscriptionRow::take_keyframes(Clock::time_point now, bool at_once) {
  const std::uint32_t all = subscription.keyframes, lacked = all & subscription.levels;
  if (lacked == 0) return all;
  if (at_once || !last_keyframe || now - *last_keyframe >= keyframe_pause) {
    subscription.keyframes &= ~lacked;
    last_keyframe = now;
    return all;
  }
  refresh_at = *last_keyframe + keyframe_pause;
  return 0;
}

void SubscriptionRow::begin_frame(Clock::time_point now) {
  waiting_since.reset();
  shown = true;
  const double rate = rate_of(subscription.spec);
  if (rate == 0) return;
  const Clock::duration pause = duration(std::min(1 / rate, kLongest));
  next_due = std::clamp(next_due + pause, now, now + pause);
}

SubscriptionTable::SubscriptionTable(std::shared_ptr<const ServedModel> model,
                                     std::shared_ptr<const Pool> kept, std::uint64_t most_voxels,
                                     DestroyLater destroy_later)
    : model_(std::move(model)),
      kept_(std::move(kept)),
      most_voxels_(most_voxels),
      destroy_later_(std::move(destroy_later)) {}

const Subscription* SubscriptionTable::add(Member& member, const SubscriptionRequest& asked,
                                           Clock::time_point now) {
  const StreamSpec& spec = asked.spec;
  auto row =
      std::find_if(rows_.begin(), rows_.end(), [&](const auto& r) { return r.subscription.spec == spec; });
  if (row == rows_.end()) {
    const auto* mesh = std::get_if<MeshSpec>(&spec);
    const std::shared_ptr<const Pool> share = member.kept_share();
    const std::shared_ptr<const Pool>& pool = share ? share : kept_;
    SubscriptionRow made;
    made.subscription.id = asked.id != 0 ? asked.id : ++last_id_;
    made.subscription.spec = spec;
    made.request = asked.request;
    const auto* volume = std::get_if<VolumeSpec>(&spec);
    std::uint64_t kept = 0;
    if (mesh) {
      made.subscription.streams = asked.streams.empty() ? open_streams(*model_, *mesh) : asked.streams;
      kept = kept_by(model_->model(), made.subscription.streams);
    }
    if (volume) {
      const std::uint64_t voxels = rest_voxels(model_->model(), *volume);
      // Of what is too large altogether nothing is ever made.
      if (voxels <= most_voxels_) kept = kept_by(model_->model(), *volume, voxels);
      made.subscription.volume = std::make_shared<VolumeStream>(*volume, voxels, pool);
    }
    if (kept > 0 && pool->full(kept)) return nullptr;
    made.kept = MemoryBudget::Reservation(pool, kept);
    row = rows_.insert(row, std::move(made));
  }
  row->members.insert(&member);
  row->subscription.keyframes = ~0U;
  row->wait(now);
  return &row->subscription;
}

// Nobody watches it any more.
void SubscriptionTable::drop(SubscriptionRow& row) const {
  if (row.subscription.volume) destroy_later_(std::move(row.subscription.volume));
  for (auto& stream : row.subscription.streams) destroy_later_(std::move(stream));
}

bool SubscriptionTable::remove(Member& member, std::uint32_t id) {
  const auto row =
      std::find_if(rows_.begin(), rows_.end(), [&](const auto& r) { return r.subscription.id == id; });
  if (row == rows_.end() || row->members.erase(&member) == 0) return false;
  if (row->members.empty()) {
    drop(*row);
    rows_.erase(row);
  }
  return true;
}

void SubscriptionTable::remove(Member& member) {
  for (SubscriptionRow& row : rows_) {
    row.members.erase(&member);
    if (row.members.empty()) drop(row);
  }
  std::erase_if(rows_, [](const auto& row) { return row.members.empty(); });
}

SubscriptionRow* SubscriptionTable::find(std::uint32_t id) {
  const auto row =
      std::find_if(rows_.begin(), rows_.end(), [&](const auto& r) { return r.subscription.id == id; });
  return row == rows_.end() ? nullptr : &*row;
}

std::vector<SubscriptionRequest> SubscriptionTable::requests_of(Member& member) const {
  std::vector<SubscriptionRequest> out;
  for (const SubscriptionRow& row : rows_) {
    if (row.members.contains(&member))
      out.push_back({.id = row.subscription.id, .spec = row.subscription.spec, .request = row.request});
  }
  return out;
}

std::map<std::uint32_t, v1::Subscribe> SubscriptionTable::requests() const {
  std::map<std::uint32_t, v1::Subscribe> out;
  for (const SubscriptionRow& row : rows_) out.emplace(row.subscription.id, row.request);
  return out;
}

bool SubscriptionTable::shows(const StreamSpec& spec) const {
  return std::any_of(rows_.begin(), rows_.end(),
                     [&](const auto& row) { return row.subscription.spec == spec; });
}

bool SubscriptionTable::shows(StreamKinds kinds) const {
  return std::any_of(rows_.begin(), rows_.end(), [&](const auto& row) { return (row.kind() & kinds) != 0; });
}

bool SubscriptionTable::anybody_waits() const {
  return std::any_of(rows_.begin(), rows_.end(),
                     [](const auto& row) { return row.waiting_since.has_value(); });
}

void SubscriptionTable::wait(StreamKinds kinds, Clock::time_point now, Clock::time_point since, bool paced) {
  for (SubscriptionRow& row : rows_) {
    if ((row.kind() & kinds) != 0 && !(paced && row.held_back(now))) row.wait(since);
  }
}

void SubscriptionTable::put_off(StreamKinds kinds, Clock::time_point until) {
  for (SubscriptionRow& row : rows_) {
    if ((row.kind() & kinds) != 0 && row.waiting_since && !row.refresh_at) row.refresh_at = until;
  }
}

void SubscriptionTable::put_off_keyframes(StreamKinds kinds, Clock::time_point now) {
  for (SubscriptionRow& row : rows_) {
    const bool lacked = (row.subscription.keyframes & row.subscription.levels) != 0;
    if ((row.kind() & kinds) == 0 || !lacked || !row.last_keyframe) continue;
    const Clock::time_point until = *row.last_keyframe + SubscriptionRow::keyframe_pause;
    if (now < until && std::exchange(row.waiting_since, std::nullopt)) row.refresh_at = until;
  }
}

std::optional<Clock::time_point> SubscriptionTable::next_due() const {
  std::optional<Clock::time_point> next;
  for (const SubscriptionRow& row : rows_) {
    if (row.refresh_at) next = std::min(next.value_or(Clock::time_point::max()), *row.refresh_at);
  }
  return next;
}

void SubscriptionTable::wake(Clock::time_point now) {
  for (SubscriptionRow& row : rows_) {
    if (!row.refresh_at || *row.refresh_at > now) continue;
    row.refresh_at.reset();
    row.wait(now);
  }
}

void SubscriptionTable::deliver(SubscriptionRow& row, const PosedFrame& frame, Clock::time_point now) {
  bool all = true;
  for (Member* member : row.members) all = member->deliver(frame) && all;
  if (all) return;
  const auto& streams = row.subscription.streams;
  row.subscription.keyframes |= streams.empty() ? 1U : 1U << (frame.level - streams.front()->level());
  row.wait(now);
}

}  // namespace ecorche::server
