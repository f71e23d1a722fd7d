// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/clip.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ecorche::server {
namespace {

// However fast it plays: no more poses than any session takes up by default.
constexpr auto kLeastPause = std::chrono::milliseconds(4);

}  // namespace

void ClipPlayer::play(std::shared_ptr<const Clip> clip, double speed, bool loop) {
  stop();
  if (clip->poses.empty()) return;
  clip_ = std::move(clip);
  speed_ = speed;
  loop_ = loop;
  start_ = Clock::now();
  step();
}

void ClipPlayer::stop() {
  ++run_;
  clip_ = nullptr;
  timer_.cancel();
}

void ClipPlayer::release() {
  stop();
  show_ = nullptr;
}

void ClipPlayer::step() {
  const Clip& clip = *clip_;
  const double length = clip.seconds();
  const double played = server::seconds(Clock::now() - start_) * speed_;
  const double lap = loop_ ? std::floor(played / length) : 0;
  const double within = played - lap * length;
  const auto next = std::upper_bound(clip.at.begin() + 1, clip.at.end(), within);
  const auto row = static_cast<std::size_t>(next - clip.at.begin()) - 1;
  const bool last = next == clip.at.end();
  const double due = lap * length + (last ? length : *next);
  const std::uint64_t run = run_;
  const std::shared_ptr<const Clip> held = clip_;  // whoever is shown a pose may stop the clip
  show_(clip.poses[row]);
  if (run_ != run) return;
  if (last && !loop_) return stop();
  timer_.expires_at(std::max(start_ + duration(due / speed_), Clock::now() + kLeastPause));
  timer_.async_wait([weak = weak_from_this(), run](const boost::system::error_code&) {
    const auto self = weak.lock();
    if (self && self->run_ == run) self->step();
  });
}

}  // namespace ecorche::server
