// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/house.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <new>
#include <tuple>
#include <utility>

namespace ecorche::server {
namespace {

// Recordings of a rig that can be played; the oldest goes.
constexpr std::size_t kMostRecorded = 16;
// Recordings under way, which grow in memory, and those that the folder may hold.
constexpr std::ptrdiff_t kMostRecording = 4, kMostFiles = 256;

// [a-z0-9_]{1,64}
bool identifier(const std::string& name) {
  return !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  });
}

// Throws nothing: what could not be made is tried again by who wants it.
void warm_up(const ServedModel& model) {
  try {
    model.meter();
  } catch (const std::bad_alloc&) {
  }
}

}  // namespace

House::House(net::io_context& io, Workers& workers, Options options, std::vector<NamedModel> models,
             Seams seams)
    : io_(io),
      workers_(workers),
      options_(std::move(options)),
      memory_(options_.limits.queued_bytes, options_.limits.kept_bytes),
      judging_(io),
      seams_(std::move(seams)),
      aside_(1, giving_way),
      volumes_(static_cast<int>(workers.threads())),
      planes_(static_cast<int>(workers.threads())) {
  if (models.empty() || models.size() > options_.limits.models) {
    throw Error(ErrorKind::config, "models", std::to_string(models.size()) + " are given",
                "serve 1 to " + std::to_string(options_.limits.models) + ", or raise --max-models");
  }
  for (NamedModel& model : models) {
    if (!sources_.emplace(model.name, std::move(model.read_again)).second)
      throw Error(ErrorKind::config, model.name, "two models have this name", "rename one of the files");
    models_.push_back(
        std::make_shared<const ServedModel>(model.name, std::move(model.model), std::move(model.clips)));
    // The first frame of all will want it.
    workers_.submit([served = models_.back()] { warm_up(*served); });
    coarsen(models_.back());
  }
}

House::~House() {
  leaving_ = true;
}

bool House::crowded(Clock::time_point now) {
  if (memory_.half_full()) crowded_ = now;
  return crowded_ && now - *crowded_ < duration(limits().stall_seconds);
}

void House::stop() {
  leaving_ = true;
  judging_.stop();
  openings_.stop();
  for (const auto& [name, session] : sessions_) session->stop_volumes();
  for (const auto& session : retired_) session->stop_volumes();
}

// Levels of detail, one tissue after another, so that whoever asks for some waits for one at most. Not for a
// model that nobody has any more.
void House::coarsen(std::shared_ptr<const ServedModel> model, std::uint32_t tissue) {
  if (leaving_ || tissue >= model->model().tissues.size() || model.use_count() == 1) return;
  aside_.submit([this, model = std::move(model), tissue]() mutable {
    if (seams_.may_coarsen && !seams_.may_coarsen()) return;
    try {
      model->make_levels({tissue});
    } catch (const std::bad_alloc&) {
      return;  // who asks is told
    }
    coarsen(std::move(model), tissue + 1);
  });
}

net::awaitable<void> House::wait(net::steady_timer& timer, boost::system::error_code& ec) {
  if (seams_.timer_fails && seams_.timer_fails()) {
    ec = net::error::operation_aborted;
    co_return;
  }
  co_await timer.async_wait(quietly(ec));
}

Status House::open(const v1::OpenModel& request, std::shared_ptr<Session>& out) {
  const auto model = std::find_if(models_.begin(), models_.end(), [&](const auto& m) {
    return request.model().empty() || m->summary.name() == request.model();
  });
  if (model == models_.end())
    return {StatusCode::not_found, "open: no model of that name (ListModels has the names)"};
  const bool named = !request.session().empty();
  if (named && !identifier(request.session())) {
    return {StatusCode::invalid_argument,
            "open: a session's name is 1 to 64 of a-z, 0-9 and _ (mend the name)"};
  }
  // An unnamed session gets a name that no client can ask for.
  const std::string name = named ? request.session() : "-" + std::to_string(++unnamed_);
  if (const auto found = sessions_.find(name); found != sessions_.end()) {
    if (found->second->model() != *model) {
      return {StatusCode::failed_precondition, "open: session '" + name + "' shows model '" +
                                                   found->second->model()->summary.name() +
                                                   "' (open that one, or another session)"};
    }
    out = found->second;
    return {};
  }
  sweep(Clock::now());
  if (sessions() >= options_.limits.sessions && !make_room()) {
    metrics_.hit("sessions");
    return {StatusCode::resource_exhausted,
            "open: " + std::to_string(sessions()) + " sessions are open (try again when one has ended)"};
  }
  const Services services{io_,
                          workers_,
                          volumes_.workers(),
                          planes_.workers(),
                          memory_,
                          judging_,
                          openings_,
                          metrics_,
                          [this](std::shared_ptr<const void> what) { let_go(std::move(what)); }};
  out = std::make_shared<Session>(services, *model, name, named, options_.limits);
  sessions_.emplace(name, out);
  return {};
}

// The one that waits for longest, of those that only wait for a client to come back, goes; those without a
// name first. Otherwise one client that makes sessions and leaves them would keep all others out.
bool House::make_room() {
  const auto rank = [](const Session& session) {
    const auto since = session.waiting();
    return std::tuple(!since, session.named(), since.value_or(Clock::time_point{}));
  };
  const auto oldest = std::min_element(sessions_.begin(), sessions_.end(), [&](const auto& a, const auto& b) {
    return rank(*a.second) < rank(*b.second);
  });
  if (oldest == sessions_.end() || !oldest->second->waiting()) return false;
  keep_recording(*oldest->second);
  sessions_.erase(oldest);
  return true;
}

void House::sweep(Clock::time_point now) {
  const auto ends = [&](const std::shared_ptr<Session>& session) {
    session->forget_probes(now);
    if (!session->over(now)) return false;
    keep_recording(*session);
    return true;
  };
  std::erase_if(sessions_, [&](const auto& entry) { return ends(entry.second); });
  std::erase_if(retired_, ends);
  const auto linger = duration(options_.limits.linger_seconds);
  std::erase_if(lost_, [&](const auto& entry) {
    return now - entry.second.since >= linger || entry.second.session.expired();
  });
  for (const auto& [name, session] : sessions_) session->catch_up();
}

void House::arrived(const std::string& token, std::function<void()> give_up) {
  live_.emplace(token, std::move(give_up));
}

void House::left(const std::string& token, std::optional<Lost> place) {
  live_.erase(token);
  if (!place || token.empty()) return;
  // Who comes and goes all the time leaves places faster than they are forgotten.
  if (lost_.size() >= options_.limits.connections) {
    lost_.erase(std::min_element(lost_.begin(), lost_.end(), [](const auto& a, const auto& b) {
      return a.second.since < b.second.since;
    }));
  }
  lost_.insert_or_assign(token, std::move(*place));
}

const Lost* House::place_of(const std::string& token) {
  if (const auto live = live_.find(token); live != live_.end()) {
    const std::function<void()> give_up = live->second;
    give_up();  // leaves its place
  }
  sweep(Clock::now());
  const auto found = lost_.find(token);
  return found == lost_.end() ? nullptr : &found->second;
}

std::vector<std::shared_ptr<const Clip>> House::clips_for(const ServedModel& model) const {
  std::vector<std::shared_ptr<const Clip>> clips = model.clips;
  const auto own = recorded_.find(model.opened.rig_digest());
  if (own != recorded_.end()) clips.insert(clips.end(), own->second.begin(), own->second.end());
  return clips;
}

void House::add_clip(std::uint64_t rig_digest, Clip clip) {
  auto& clips = recorded_[rig_digest];
  if (clip.poses.empty()) return;
  if (clips.size() >= kMostRecorded) clips.erase(clips.begin());
  clips.push_back(std::make_shared<const Clip>(std::move(clip)));
}

Status House::recording_path(const std::string& name, std::filesystem::path& out) const {
  if (options_.record_folder.empty()) {
    return {StatusCode::failed_precondition,
            "record: this server keeps no recordings (serve with --record-dir)"};
  }
  if (!identifier(name))
    return {StatusCode::invalid_argument, "record: a name is 1 to 64 of a-z, 0-9 and _ (mend the name)"};
  out = options_.record_folder / (name + ".ecrec");
  std::error_code ec;
  if (std::filesystem::exists(out, ec))
    return {StatusCode::already_exists, "record: there is a recording '" + name + "' (choose another name)"};
  return {};
}

void House::finish_recording(Session& session, std::function<void(const Status&)> done) {
  const std::shared_ptr<Recording> recording = session.recording();
  std::filesystem::path path;
  if (const Status status = recording_path(recording->name(), path); !status.ok()) return done(status);
  std::erase_if(ending_, [](const auto& one) { return one.expired(); });
  ending_.push_back(recording);
  session.end_recording([this, recording, path, rig = session.model()->opened.rig_digest(),
                         done = std::move(done)] { write(recording, path, rig, done); });
}

void House::write(const std::shared_ptr<Recording>& recording, const std::filesystem::path& path,
                  std::uint64_t rig_digest, const std::function<void(const Status&)>& done) {
  const auto clip = std::make_shared<Clip>(recording->finish());
  const auto written = std::make_shared<Status>();
  offload([recording, path, written] { *written = recording->write(path); },
          [this, recording, clip, written, rig_digest, done] {
            if (written->ok()) add_clip(rig_digest, std::move(*clip));
            if (written->ok() && recording->full()) {
              *written = {StatusCode::resource_exhausted,
                          "record: it grew to the server's limit, and is whole up to there (record less)"};
            }
            done(*written);
          });
}

// Nobody ended it: it ends with its session.
void House::keep_recording(Session& session) {
  if (!session.recording()) return;
  finish_recording(session, [name = session.recording()->name()](const Status& status) {
    if (!status.ok()) spdlog::warn("recording {}: {}", name, status.message);
  });
}

void House::end_recordings() {
  for (const auto& [name, session] : sessions_) keep_recording(*session);
  for (const auto& session : retired_) keep_recording(*session);
}

Status House::room_for_recording(const std::string& name) const {
  std::ptrdiff_t running = 0;
  bool same = false;
  const auto look_at = [&](const std::shared_ptr<const Recording>& recording) {
    if (!recording) return;
    ++running;
    same = same || recording->name() == name;
  };
  for (const auto& entry : sessions_) look_at(entry.second->recording());
  for (const auto& session : retired_) look_at(session->recording());
  for (const auto& recording : ending_) look_at(recording.lock());
  if (same) {
    return {StatusCode::already_exists,
            "record: another session's recording '" + name + "' runs (choose another name)"};
  }
  if (running >= kMostRecording) {
    return {StatusCode::resource_exhausted,
            "record: " + std::to_string(running) + " recordings run already (try again later)"};
  }
  std::error_code ec;
  const std::filesystem::directory_iterator files(options_.record_folder, ec);
  if (!ec && std::distance(begin(files), end(files)) >= kMostFiles)
    return {StatusCode::resource_exhausted, "record: the server's folder is full (ask who runs it)"};
  return {};
}

void House::reload(const std::string& name, std::function<void(const Status&)> done) {
  const auto source = sources_.find(name);
  if (source == sources_.end())
    return done({StatusCode::not_found, "reload: no model of that name (ListModels has the names)"});
  if (!source->second)
    return done({StatusCode::failed_precondition,
                 "reload: this model was not read from a file (restart the server)"});
  if (reloading_) return done({StatusCode::unavailable, "reload: another model is being read (try again)"});
  reloading_ = true;
  struct Reading {
    Status status;
    std::shared_ptr<const ServedModel> model;
  };
  const auto reading = std::make_shared<Reading>();
  const auto work = [reading, read = source->second, name] {
    try {
      ModelParts parts = read();
      reading->model = std::make_shared<const ServedModel>(name, parts.model, std::move(parts.clips));
      warm_up(*reading->model);
    } catch (const Error& error) {
      reading->status = to_status(error);
    } catch (const std::bad_alloc&) {
      reading->status = {StatusCode::resource_exhausted, "reload: the server is out of memory (restart it)"};
    } catch (const std::exception& error) {
      reading->status = {StatusCode::internal, error.what()};
    }
  };
  // Beside all else: nobody waits for it but who asked.
  set_aside(work, [this, reading, done = std::move(done)] {
    reloading_ = false;
    if (reading->status.ok()) replace(reading->model);
    done(reading->status);
  });
}

void House::replace(std::shared_ptr<const ServedModel> model) {
  const auto old = std::find_if(models_.begin(), models_.end(),
                                [&](const auto& m) { return m->summary.name() == model->summary.name(); });
  const std::uint64_t identity = model->opened.identity();
  if ((*old)->opened.identity() == identity &&
      (*old)->opened.topology_digest() == model->opened.topology_digest())
    return;
  for (auto it = sessions_.begin(); it != sessions_.end();) {
    if (it->second->model() != *old) {
      ++it;
      continue;
    }
    it->second->retire(identity);
    retired_.push_back(it->second);
    it = sessions_.erase(it);
  }
  *old = std::move(model);
  coarsen(*old);
}

void House::offload(std::function<void()> work, std::function<void()> then) {
  offers_.emplace_back(std::move(work), std::move(then));
  offer();
}

// Without memory nothing is lost: what could not be handed over waits for the next time.
void House::offer() {
  const std::size_t most = std::max<std::size_t>(workers_.threads(), 2) - 1;
  while (offloaded_ < most && !offers_.empty()) {
    const auto& [work, then] = offers_.front();
    hand_over(workers_, work, [this, then = then] {
      --offloaded_;
      try {
        offer();
      } catch (const std::bad_alloc&) {
      }
      then();
    });
    ++offloaded_;
    offers_.pop_front();
  }
}

void House::set_aside(std::function<void()> work, std::function<void()> then) {
  hand_over(aside_, std::move(work), std::move(then));
}

void House::let_go(std::shared_ptr<const void> what) noexcept {
  try {
    aside_.submit([what = std::move(what)]() mutable { what = nullptr; });
  } catch (const std::exception&) {  // no memory to say so: it goes here
  }
}

void House::hand_over(Workers& to, std::function<void()> work, std::function<void()> then) {
  to.submit([&io = io_, work = std::move(work), then = std::move(then),
             guard = net::make_work_guard(io_)]() mutable {
    work();
    // What both hold ends on the I/O thread.
    net::post(io, [work = std::move(work), then = std::move(then), guard = std::move(guard)] { then(); });
  });
}

}  // namespace ecorche::server
