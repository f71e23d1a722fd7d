// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/session.hpp"

#include <algorithm>
#include <utility>

#include "runtime/server/resources/journal.hpp"
#include "runtime/server/session/retained_bytes.hpp"

namespace ecorche::server {
namespace {

constexpr auto kBetweenMembers = std::chrono::milliseconds(250);
constexpr auto kBetweenClips = std::chrono::milliseconds(100);
constexpr auto kWhilePlaying = std::chrono::milliseconds(500);

}  // namespace

Session::Session(const Services& services, std::shared_ptr<const ServedModel> model, std::string name,
                 bool named, const Limits& limits, SessionOwner owner)
    : io_(services.io),
      executor_(services.executor),
      memory_(services.memory),
      metrics_(services.metrics),
      activity_(services.activity),
      quality_turns_(services.quality_turns),
      first_frames_(services.first_frames),
      journal_(services.journal),
      model_(std::move(model)),
      name_(std::move(name)),
      named_(named),
      limits_(limits),
      owner_(std::move(owner)),
      account_(std::make_shared<Account>(owner_.account)),
      control_(duration(limits.linger_seconds), Clock::now()),
      poses_(Pose::rest(model_->model().segment_count())),
      table_(model_, memory_.kept_pool(), limits.volume_voxels, services.destroy_later),
      planner_(table_, model_, memory_, activity_, limits.volume_voxels),
      pacer_(io_, limits.poses_per_second, [this] { start_jobs(); }),
      volumes_(io_, executor_, memory_, table_, planner_, limits.poses_per_second, [this] { start_jobs(); }),
      probes_(kept_by_probe(model_->model()), owner_.kept ? owner_.kept : memory_.kept_pool(),
              services.destroy_later),
      quality_(executor_, quality_turns_, table_, poses_, model_, [this] { start_jobs(); }),
      player_(std::make_shared<ClipPlayer>(
          io_,
          [this](const Pose& pose) {
            PoseRequest request;
            request.sequence = clip_sequence_ = poses_.last_sequence() + 1;
            request.pose = pose;
            request.skinning = poses_.present().skinning;
            put(std::move(request));
          },
          [this] { clip_news_.changed(); })),
      members_news_(io_, kBetweenMembers, [this] { tell_members(); }),
      clip_news_(io_, kBetweenClips, [this] { tell_clip(); }),
      alarm_(io_,
             [this] {
               table_.wake(Clock::now());
               set_alarm();
               start_jobs();
             }),
      quality_turn_([this] { return quality_.measure(shared_from_this()); }, account_),
      first_frame_turn_([this] { return show_newcomers(); }, account_) {
  control_.on_change([this] {
    presence_.follow(control_);
    members_news_.changed();
  });
}

Session::~Session() {
  player_->release();
}

void Session::log_error(const std::string& what) const {
  if (journal_) journal_->line(spdlog::level::err, {.text = what, .session = name_});
}

v1::Role Session::join(Member& member, bool heir) {
  if (player_->clip()) clip_news_.changed();
  return control_.join(member, heir, Clock::now());
}

v1::Role Session::rejoin(Member& member, bool control) {
  if (player_->clip()) clip_news_.changed();
  return control_.rejoin(member, control, Clock::now());
}

void Session::leave(Member& member, bool may_return) {
  const auto now = Clock::now();
  table_.remove(member);
  volumes_.stop_unwatched();
  control_.leave(member, may_return, now);
  if (!control_.members().empty()) return;
  player_->stop();
  members_news_.cancel();
  clip_news_.cancel();
  set_alarm();  // a server that stops would wait for who watches at the slowest rate
  forget_probes(now);
}

const Subscription* Session::subscribe(Member& member, const SubscriptionRequest& asked) {
  const Subscription* const subscription = table_.add(member, asked, Clock::now());
  // Once the answer with the number is on its way.
  if (subscription) net::post(io_, [self = shared_from_this()] { self->start_jobs(); });
  return subscription;
}

bool Session::unsubscribe(Member& member, std::uint32_t id) {
  if (!table_.remove(member, id)) return false;
  volumes_.stop_unwatched();
  return true;
}

void Session::pose(PoseRequest request) {
  player_->stop();
  // Sent before its client heard of the clip's newest poses: it comes after them all the same.
  if (request.sequence <= clip_sequence_) request.sequence = poses_.last_sequence() + 1;
  put(std::move(request));
}

void Session::put(PoseRequest request) {
  poses_.put(std::move(request), Clock::now(), pacer_.busy());
  start_jobs();
}

void Session::ask_for_control(Member& member, bool asks) {
  if (presence_.ask(member, asks)) members_news_.changed();
}

void Session::tell(v1::Feature feature, const v1::Envelope& news) const {
  const auto hears = [&](const Member* member) { return member->hears_of(feature); };
  const std::set<Member*>& members = control_.members();
  if (std::none_of(members.begin(), members.end(), hears)) return;
  const auto encoded = std::make_shared<const wire::EncodedFrame>(wire::encode(news));
  for (Member* member : members) {
    if (hears(member)) member->tell(encoded);
  }
}

void Session::tell_members() const {
  v1::Envelope envelope;
  *envelope.mutable_members() = presence_.list(control_);
  tell(v1::FEATURE_PRESENCE, envelope);
}

void Session::tell_clip() {
  v1::Envelope envelope;
  v1::ClipState& state = *envelope.mutable_clip_state();
  if (const std::shared_ptr<const Clip>& clip = player_->clip()) {
    state.set_name(clip->name);
    state.set_position(player_->position());
    state.set_seconds(clip->seconds());
    state.set_frames_per_second(clip->frames_per_second());
    state.set_speed(player_->speed());
    state.set_loop(player_->loops());
    state.set_playing(player_->playing());
  }
  tell(v1::FEATURE_CLIP_STATE, envelope);
  if (player_->playing()) clip_news_.schedule_after(kWhilePlaying);
}

void Session::set_thresholds(const runtime::QualityThresholds& thresholds) {
  quality_.set_thresholds(thresholds, Clock::now());
  start_jobs();
}

bool Session::hang(std::size_t row, std::optional<runtime::Hanging> hanging) {
  std::shared_ptr<const HungSkeleton> hung;
  if (hanging) {
    const std::uint64_t bytes = kept_by_hung(model_->model(), row);
    const std::shared_ptr<const Pool>& pool = owner_.kept ? owner_.kept : memory_.kept_pool();
    // What it replaces goes once the jobs under way are over.
    if (pool->full(bytes)) {
      metrics_.hit("kept");
      return false;
    }
    hung = std::make_shared<const HungSkeleton>(model_, std::move(*hanging),
                                                MemoryBudget::Reservation(pool, bytes));
  }
  hung_.set(row, std::move(hung));
  const auto now = Clock::now();
  table_.wait(kVolumes | kPlanes, now, now, true);
  set_alarm();
  start_jobs();
  return true;
}

void Session::probe(ProbeQueue::Ready ready, bool many) {
  probes_.ask(std::move(ready), many, Clock::now());
  if (probes_.anybody_waits()) start_jobs();
}

void Session::forget_probes(Clock::time_point now) {
  // A job may have a tree, and would take whoever asks now for one of those that it could not answer.
  if (!pacer_.busy()) probes_.forget(!control_.members().empty(), now);
}

std::optional<Clock::time_point> Session::abandoned() const {
  if (!recorder_.running() || control_.controller()) return std::nullopt;
  return control_.uncontrolled_since();
}

void Session::catch_up() {
  if (table_.anybody_waits()) start_jobs();
}

void Session::has_read() {
  if (planner_.take_unread()) start_jobs();
}

void Session::arrived() {
  if (quality_.take_unmeasured()) quality_turns_.ask(quality_turn());
}

void Session::retire(std::uint64_t identity) {
  retired_ = true;
  for (Member* member : control_.members()) member->model_changed(identity);
}

bool Session::over(Clock::time_point now) const {
  const auto since = waiting();
  if (!since) return false;
  if (retired_ || (!named_ && !control_.awaits_return())) return true;
  return now - *since >= duration(limits_.linger_seconds);
}

std::optional<Clock::time_point> Session::waiting() const {
  if (pacer_.busy() || volumes_.busy()) return std::nullopt;
  return control_.empty_since();
}

}  // namespace ecorche::server
