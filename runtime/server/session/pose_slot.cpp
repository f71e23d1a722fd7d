// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/pose_slot.hpp"

#include <algorithm>
#include <utility>

namespace ecorche::server {
namespace {

bool same(const Pose& a, const Pose& b) {
  const auto equal = [](const auto& x, const auto& y) { return x.coeffs() == y.coeffs(); };
  return a.root_translation == b.root_translation && a.translation == b.translation &&
         std::equal(a.rotation.begin(), a.rotation.end(), b.rotation.begin(), b.rotation.end(), equal);
}

}  // namespace

void Skipped::add(std::uint64_t sequence) {
  ++count;
  newest.push_back(sequence);
  if (newest.size() > most_listed) newest.pop_front();
}

void PoseSlot::put(PoseRequest request, Clock::time_point now, bool busy) {
  last_sequence_ = request.sequence;
  if (next_)
    skipped_.add(next_->sequence);
  else
    after_rest_ = rests(now, busy);
  stirred_ = now;
  next_ = std::move(request);
}

void PoseSlot::begin(Clock::time_point now) {
  begun_ = now;
  if (!same(next_->pose, present_.pose)) moved_ = now;
}

PoseRequest PoseSlot::take() {
  return *std::exchange(next_, std::nullopt);
}

std::optional<Clock::time_point> PoseSlot::next_expected(Clock::time_point now) const {
  if (now - begun_ >= next_within) return std::nullopt;
  return begun_ + next_within;
}

}  // namespace ecorche::server
