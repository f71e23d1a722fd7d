// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/session.hpp"

#include <algorithm>
#include <utility>

#include "runtime/server/resources/journal.hpp"
#include "runtime/server/session/mesh_streams.hpp"
#include "runtime/server/session/retained_bytes.hpp"
#include "runtime/server/session/volume_stream.hpp"

namespace ecorche::server {
namespace {

// So long after the last probe, poses are still made ready for the next; and so long what that takes is kept.
constexpr std::chrono::seconds kProbing{1}, kForgotten{10};

}  // namespace

void Skipped::add(std::uint64_t sequence) {
  ++count;
  newest.push_back(sequence);
  if (newest.size() > most_told) newest.pop_front();
}

Session::Session(const Services& services, std::shared_ptr<const ServedModel> model, std::string name,
                 bool named, const Limits& limits)
    : io_(services.io),
      metrics_(services.metrics),
      memory_(services.memory),
      quality_turns_(services.quality_turns),
      first_frames_(services.first_frames),
      activity_(services.activity),
      destroy_later_(services.destroy_later),
      journal_(services.journal),
      model_(std::move(model)),
      name_(std::move(name)),
      named_(named),
      limits_(limits),
      kept_(memory_.kept_pool()),
      quality_turn_([this] { return measure_quality(); }, account_),
      first_frame_turn_([this] { return show_newcomers(); }, account_),
      poses_(io_, services.workers),
      whole_(io_, services.volume_workers),
      planes_(io_, services.plane_workers),
      clock_(io_) {
  present_.pose = Pose::rest(model_->model().segment_count());
  player_ = std::make_shared<ClipPlayer>(io_, [this](const Pose& pose) {
    PoseRequest request;
    request.sequence = last_sequence_ + 1;
    request.pose = pose;
    request.skinning = present_.skinning;
    take(std::move(request));
  });
}

void Session::complain(const std::string& what) const {
  if (journal_) journal_->line(spdlog::level::err, "session " + name_ + ": " + what);
}

Session::~Session() {
  player_->release();
}

void Session::retire(std::uint64_t identity) {
  retired_ = true;
  for (Member* member : members_) member->model_changed(identity);
}

const Subscription* Session::subscribe(Member& member, const SubscriptionRequest& asked) {
  const StreamSpec& spec = asked.spec;
  auto row =
      std::find_if(rows_.begin(), rows_.end(), [&](const Row& r) { return r.subscription.spec == spec; });
  if (row == rows_.end()) {
    const auto* mesh = std::get_if<MeshSpec>(&spec);
    const std::shared_ptr<const Pool> share = member.kept_share();
    const std::shared_ptr<const Pool>& pool = share ? share : memory_.kept_pool();
    Row made;
    made.subscription.id = asked.id != 0 ? asked.id : ++last_subscription_;
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
      if (voxels <= limits_.volume_voxels) kept = kept_by(model_->model(), *volume, voxels);
      made.subscription.volume = std::make_shared<VolumeStream>(*volume, voxels, pool);
    }
    if (kept > 0 && pool->full(kept)) return nullptr;
    made.kept = MemoryBudget::Reservation(pool, kept);
    row = rows_.insert(row, std::move(made));
  }
  row->members.insert(&member);
  row->subscription.keyframes = ~0U;
  row->fresh = row->fresh.value_or(Clock::now());
  // Once the answer with the number is on its way.
  net::post(io_, [self = shared_from_this()] { self->start_jobs(); });
  return &row->subscription;
}

// Nobody watches it any more.
void Session::drop(Row& row) const {
  if (row.subscription.volume) destroy_later_(std::move(row.subscription.volume));
  for (auto& stream : row.subscription.streams) destroy_later_(std::move(stream));
}

std::vector<SubscriptionRequest> Session::requests_of(Member& member) const {
  std::vector<SubscriptionRequest> out;
  for (const Row& row : rows_) {
    if (row.members.contains(&member))
      out.push_back({.id = row.subscription.id, .spec = row.subscription.spec, .request = row.request});
  }
  return out;
}

bool Session::shows(const StreamSpec& spec) const {
  return std::any_of(rows_.begin(), rows_.end(),
                     [&](const Row& row) { return row.subscription.spec == spec; });
}

bool Session::unsubscribe(Member& member, std::uint32_t id) {
  const auto row =
      std::find_if(rows_.begin(), rows_.end(), [&](const Row& r) { return r.subscription.id == id; });
  if (row == rows_.end() || row->members.erase(&member) == 0) return false;
  if (row->members.empty()) {
    drop(*row);
    rows_.erase(row);
  }
  stop_unwatched();
  return true;
}

void Session::play(std::shared_ptr<const Clip> clip, double speed, bool loop) {
  player_->play(std::move(clip), speed, loop);
}

void Session::set_thresholds(const runtime::QualityThresholds& thresholds) {
  thresholds_ = thresholds;
  for (Row& row : rows_) {
    row.subscription.quality = nullptr;  // with the next frame
    const auto* mesh = std::get_if<MeshSpec>(&row.subscription.spec);
    if (mesh && mesh->quality) row.fresh = row.fresh.value_or(Clock::now());
  }
  start_jobs();
}

void Session::pose(PoseRequest request) {
  player_->stop();
  take(std::move(request));
}

void Session::take(PoseRequest request) {
  last_sequence_ = request.sequence;
  const auto now = Clock::now();
  if (slot_)
    skipped_.add(slot_->sequence);
  else
    rested_ = rests(now);
  stirred_ = now;
  slot_ = std::move(request);
  start_jobs();
}

bool Session::over(Clock::time_point now) const {
  if (!members_.empty() || poses_.busy || volumes_busy()) return false;
  if (retired_ || (!named_ && !awaited_)) return true;
  return now - last_seen_ >= duration(limits_.linger_seconds);
}

std::optional<Clock::time_point> Session::waiting() const {
  if (!members_.empty() || poses_.busy || volumes_busy()) return std::nullopt;
  return last_seen_;
}

void Session::probe(Ready ready, bool many) {
  probed_ = Clock::now();
  if (many) probed_many_ = probed_;
  if (probe_frame_) return ready(probe_frame_, {});
  probes_.push_back(std::move(ready));
  start_jobs();
}

void Session::take_up_probes(PoseJob& job, bool refresh) {
  const auto now = Clock::now();
  const auto lately = [now](const auto& then) { return then && now - *then < kProbing; };
  if (!probes_.empty() || lately(probed_)) job.probe = spare_probe();
  job.probe_many = lately(probed_many_);
  if (job.probe) return;
  if (!refresh) probe_frame_ = nullptr;  // it shows an older pose soon
  if (probes_.empty()) return;
  metrics_.hit("kept");
  probe_ready(nullptr, {StatusCode::resource_exhausted,
                        "probe: what is kept for streams and probes fills the server's memory for it (try "
                        "again when somebody has unsubscribed)"});
}

// One that nobody asks any more, or a new one: the one that is shown and the one being made are two, and more
// where questions about older ones wait. Null where no more may be kept.
std::shared_ptr<ProbeFrame> Session::spare_probe() {
  for (const auto& frame : probe_frames_) {
    if (frame.use_count() == 1) return frame;
  }
  const std::uint64_t kept = kept_by_probe(model_->model());
  if (kept_->full(kept)) return nullptr;
  auto frame = std::make_shared<ProbeFrame>();
  frame->kept = MemoryBudget::Reservation(kept_, kept);
  return probe_frames_.emplace_back(std::move(frame));
}

void Session::probe_ready(const std::shared_ptr<ProbeFrame>& frame, const Status& status) {
  probe_frame_ = frame;
  for (const Ready& ready : std::exchange(probes_, {})) ready(frame, status);
}

void Session::forget_probes(Clock::time_point now) {
  // A job may have a tree, and would take whoever asks now for one of those that it could not answer.
  if (poses_.busy || !probes_.empty() || (!members_.empty() && probed_ && now - *probed_ < kForgotten))
    return;
  probe_frame_.reset();
  for (auto& frame : std::exchange(probe_frames_, {})) destroy_later_(std::move(frame));
}

}  // namespace ecorche::server
