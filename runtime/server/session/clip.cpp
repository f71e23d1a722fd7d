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

std::size_t Clip::row_at(double seconds) const {
  return static_cast<std::size_t>(std::upper_bound(at.begin() + 1, at.end(), seconds) - at.begin()) - 1;
}

void ClipPlayer::play(std::shared_ptr<const Clip> clip, const ClipStart& start) {
  stop();
  if (clip->poses.empty()) return;
  clip_ = std::move(clip);
  shown_.reset();
  speed_ = start.speed;
  loop_ = start.loop;
  playing_ = !start.paused;
  go_to(start.position);
}

void ClipPlayer::steer(const ClipSteering& to) {
  if (!clip_) return;
  const double was = position();
  double position = to.position.value_or(was);
  speed_ = to.speed.value_or(speed_);
  loop_ = to.loop.value_or(loop_);
  playing_ = !to.paused.value_or(!playing_);
  if (to.step != 0) {
    const auto last = static_cast<std::int64_t>(clip_->at.size()) - 1;
    const auto row = static_cast<std::int64_t>(clip_->row_at(position)) + to.step;
    position = clip_->at[static_cast<std::size_t>(std::clamp<std::int64_t>(row, 0, last))];
    playing_ = false;
  }
  if (playing_ && to.paused && !to.position && position >= clip_->seconds()) position = 0;
  go_to(position);
}

void ClipPlayer::stop() {
  ++run_;
  const bool was = std::exchange(clip_, nullptr) != nullptr;
  playing_ = false;
  timer_.cancel();
  if (was && changed_) changed_();
}

void ClipPlayer::release() {
  changed_ = nullptr;
  stop();
  show_ = nullptr;
}

double ClipPlayer::played() const {
  return playing_ ? at_ + server::seconds(Clock::now() - since_) * speed_ : at_;
}

double ClipPlayer::within(double played) const {
  const double length = clip_->seconds();
  return loop_ && played >= length ? std::fmod(played, length) : std::min(played, length);
}

double ClipPlayer::position() const {
  return clip_ ? within(played()) : 0;
}

void ClipPlayer::go_to(double played) {
  ++run_;
  timer_.cancel();
  at_ = played;
  since_ = Clock::now();
  changed_();
  show_now();
}

void ClipPlayer::show_now() {
  const double now = played();
  const std::uint64_t run = run_;
  const std::shared_ptr<const Clip> held = clip_;  // whoever is shown a pose may stop the clip
  const std::size_t row = held->row_at(within(now));
  if (std::exchange(shown_, row) != row) show_(held->poses[row]);
  if (run_ == run && playing_) wait_for_next(now);
}

void ClipPlayer::wait_for_next(double played) {
  const double length = clip_->seconds(), position = within(played);
  const auto next = std::upper_bound(clip_->at.begin() + 1, clip_->at.end(), position);
  const double due = next == clip_->at.end() ? length : *next;
  if (!loop_ && position >= length) {
    playing_ = false;
    at_ = length;
    return changed_();
  }
  timer_.expires_at(
      std::max(since_ + duration((played - position + due - at_) / speed_), Clock::now() + kLeastPause));
  timer_.async_wait([weak = weak_from_this(), run = run_](const boost::system::error_code&) {
    const auto self = weak.lock();
    if (self && self->run_ == run) self->show_now();
  });
}

}  // namespace ecorche::server
