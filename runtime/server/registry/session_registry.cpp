// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/registry/session_registry.hpp"
#include "core/values/identifier.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <new>
#include <tuple>
#include <utility>

#include "core/platform/heap.hpp"
#include "runtime/server/net/tls.hpp"
#include "runtime/server/registry/unnamed_files.hpp"
#include "runtime/server/resources/shares.hpp"
#include "runtime/server/schedule/post_back.hpp"
#include "runtime/server/schedule/serially.hpp"
#include "runtime/server/session/quality_job.hpp"

namespace ecorche::server {
namespace {

// Throws nothing: what could not be made is tried again by who wants it.
void warm_up(const ServedModel& model) {
  try {
    model.meter();
  } catch (const std::bad_alloc&) {
  }
}

// Who shows the one token may do all.
std::vector<Pass> all_passes(const Options& options, std::vector<Pass> passes) {
  if (!options.token.empty()) passes.push_back({.name = "token", .digest = digest_of(options.token)});
  return passes;
}

}  // namespace

SessionRegistry::SessionRegistry(net::io_context& io, Workers& workers, Options options,
                                 std::vector<NamedModel> models, TestHooks hooks)
    : io_(io),
      options_(std::move(options)),
      passes_(std::make_shared<Passes>(all_passes(options_, options_.passes))),
      memory_(options_.limits.queued_bytes, options_.limits.kept_bytes),
      hooks_(std::move(hooks)),
      executor_(io, workers),
      quality_turns_(io, TurnQueue::Order::first_come, kQualityPause),
      first_frames_(io, TurnQueue::Order::least_used),
      recordings_(executor_, options_),
      journal_(options_.limits.log_lines_per_second, options_.log) {
  if (models.empty() || models.size() > options_.limits.models) {
    throw Error(ErrorKind::config, "models", std::to_string(models.size()) + " are given",
                "serve 1 to " + std::to_string(options_.limits.models) + ", or raise --max-models");
  }
  for (NamedModel& model : models) {
    if (!sources_.emplace(model.name, std::move(model.read_again)).second)
      throw Error(ErrorKind::config, model.name, "two models have this name", "rename one of the files");
    models_.push_back(std::make_shared<const ServedModel>(
        model.name, std::move(model.model), std::move(model.clips), std::move(model.poses), options_.pages));
    // The first frame of all will want it.
    executor_.submit(Service::frames, [served = models_.back()] { warm_up(*served); });
    prepare_details(models_.back());
  }
}

SessionRegistry::~SessionRegistry() {
  leaving_ = true;
}

bool SessionRegistry::crowded(Clock::time_point now) {
  if (memory_.half_full()) crowded_ = now;
  return crowded_ && now - *crowded_ < duration(limits().stall_seconds);
}

void SessionRegistry::stop() {
  leaving_ = true;
  quality_turns_.stop();
  first_frames_.stop();
  for (const auto& [name, session] : sessions_) session->stop_volumes();
  for (const auto& session : retired_) session->stop_volumes();
}

// Packed triangles, then levels of detail and what is asked of bones that run into each other, one tissue
// after another, so that whoever asks for some waits for one at most. Not for a model that nobody has any
// more.
void SessionRegistry::prepare_details(std::shared_ptr<const ServedModel> model, std::uint32_t tissue) {
  if (leaving_ || tissue >= model->model().tissues.size() || model.use_count() == 1) return;
  executor_.submit(Service::levels, [this, model = std::move(model), tissue]() mutable {
    if (hooks_.may_coarsen && !hooks_.may_coarsen()) return;
    try {
      serially([&] { model->meter().prepare(tissue); });  // the other cores are for frames
      if (tissue == 0) model->pack_triangles();
      model->make_levels({tissue});
      if (tissue + 1 == model->model().tissues.size()) model->share_details();
      prepare_details(std::move(model), tissue + 1);
    } catch (const std::bad_alloc&) {  // who asks is told
    }
  });
}

net::awaitable<void> SessionRegistry::wait(net::steady_timer& timer, boost::system::error_code& ec) {
  if (hooks_.timer_fails && hooks_.timer_fails()) {
    ec = net::error::operation_aborted;
    co_return;
  }
  co_await timer.async_wait(quietly(ec));
}

Status SessionRegistry::open(const v1::OpenModel& request, const std::string& address,
                             std::shared_ptr<Session>& out) {
  const auto model = std::find_if(models_.begin(), models_.end(), [&](const auto& m) {
    return request.model().empty() || m->summary.name() == request.model();
  });
  if (model == models_.end())
    return {StatusCode::not_found, "open: no model of that name (ListModels has the names)"};
  const bool named = !request.session().empty();
  if (named && !is_identifier(request.session())) {
    return {StatusCode::invalid_argument,
            "open: a session's name is 1 to 64 of a-z, 0-9 and _ (mend the name)"};
  }
  // An unnamed session gets a name that nobody can guess, and that who is told it can ask for.
  const std::string name = named ? request.session() : "s_" + random_token();
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
  if (sessions() >= options_.limits.sessions && !evict()) {
    metrics_.hit("sessions");
    return {StatusCode::resource_exhausted,
            "open: " + std::to_string(sessions()) + " sessions are open (try again when one has ended)"};
  }
  const auto own = [&](const Session& session) { return session.owner() == address; };
  const auto count =
      std::count_if(sessions_.begin(), sessions_.end(), [&](const auto& s) { return own(*s.second); }) +
      std::count_if(retired_.begin(), retired_.end(), [&](const auto& s) { return own(*s); });
  const std::uint64_t most = portion(options_.limits.sessions, options_.limits.peer_share);
  if (!address.empty() && static_cast<std::uint64_t>(count) >= most && !evict(address)) {
    metrics_.hit("sessions");
    return {StatusCode::resource_exhausted, "open: " + std::to_string(count) +
                                                " sessions of your address are open (leave one, or ask for "
                                                "a larger --peer-share)"};
  }
  const Services services{
      .io = io_,
      .executor = executor_,
      .memory = memory_,
      .quality_turns = quality_turns_,
      .first_frames = first_frames_,
      .activity = activity_,
      .metrics = metrics_,
      .destroy_later = [this](std::shared_ptr<const void> what) { executor_.destroy_later(std::move(what)); },
      .journal = &journal_};
  const std::shared_ptr<const ClientShare> of = share_of(address);
  out = std::make_shared<Session>(services, *model, name, named, options_.limits,
                                  SessionOwner{.address = address, .kept = of->kept, .account = of->account});
  const auto now = Clock::now();
  const auto before = [&](const auto& session) {
    return session->name() == name && session->control().taken(now);
  };
  if (std::any_of(retired_.begin(), retired_.end(), before)) out->control().await_heir(now);
  sessions_.emplace(name, out);
  return {};
}

std::shared_ptr<const SessionRegistry::ClientShare> SessionRegistry::share_of(const std::string& address) {
  // Whoever has none of it left is forgotten.
  std::erase_if(client_shares_, [&](const auto& entry) {
    return entry.first != address && entry.second->kept.use_count() == 1 &&
           entry.second->account.use_count() == 1;
  });
  std::shared_ptr<const ClientShare>& of = client_shares_[address];
  if (!of) {
    const std::uint64_t most = portion(options_.limits.kept_bytes, options_.limits.peer_share);
    of = std::make_shared<const ClientShare>(
        ClientShare{std::make_shared<const Pool>(most, memory_.kept_pool()), std::make_shared<Account>()});
  }
  return of;
}

// The one that waits for longest, of those that only wait for a client to come back, goes; those without a
// name first; with an address, of those of its clients. Otherwise one client that makes sessions and leaves
// them would keep all others out.
bool SessionRegistry::evict(const std::string& address) {
  const auto rank = [&](const Session& session) {
    const bool other = !address.empty() && session.owner() != address;
    const auto since = other ? std::nullopt : session.waiting();
    return std::tuple(!since, session.named(), since.value_or(Clock::time_point{}));
  };
  const auto oldest = std::min_element(sessions_.begin(), sessions_.end(), [&](const auto& a, const auto& b) {
    return rank(*a.second) < rank(*b.second);
  });
  if (oldest == sessions_.end() || std::get<0>(rank(*oldest->second))) return false;
  recordings_.keep(*oldest->second);
  sessions_.erase(oldest);
  return true;
}

void SessionRegistry::sweep(Clock::time_point now) {
  // Models that nobody may have any more: they end elsewhere, after their sessions.
  std::vector<std::shared_ptr<const ServedModel>> old;
  old.reserve(retired_.size());
  const auto ends = [&](const std::shared_ptr<Session>& session) {
    session->forget_probes(now);
    session->control().expire(now);
    const bool over = session->over(now);
    const auto since = session->abandoned();
    if (over || (since && now - *since >= Recordings::abandoned_after)) recordings_.keep(*session);
    if (over && session->retired()) old.push_back(session->model());
    return over;
  };
  std::erase_if(sessions_, [&](const auto& entry) { return ends(entry.second); });
  std::erase_if(retired_, ends);
  if (!old.empty()) {
    for (auto& model : old) executor_.destroy_later(std::move(model));
    tidy_up();
  }
  const auto linger = duration(options_.limits.linger_seconds);
  std::erase_if(places_, [&](const auto& entry) {
    return now - entry.second.since >= linger || entry.second.session.expired();
  });
  for (const auto& [name, session] : sessions_) session->catch_up();
  recordings_.tick(now);
  journal_.tick(now);
}

void SessionRegistry::arrived(const std::string& token, std::function<void()> give_up) {
  live_.emplace(token, std::move(give_up));
}

void SessionRegistry::left(const std::string& token, std::optional<SavedPlace> place) noexcept {
  live_.erase(token);
  if (!place || token.empty()) return;
  // Who comes and goes all the time leaves places faster than they are forgotten.
  if (places_.size() >= options_.limits.connections) {
    places_.erase(std::min_element(places_.begin(), places_.end(), [](const auto& a, const auto& b) {
      return a.second.since < b.second.since;
    }));
  }
  try {
    places_.insert_or_assign(token, std::move(*place));
  } catch (const std::bad_alloc&) {
  }
}

const SavedPlace* SessionRegistry::find_place(const std::string& token) {
  if (const auto live = live_.find(token); live != live_.end()) {
    const std::function<void()> give_up = live->second;
    give_up();  // leaves its place
  }
  sweep(Clock::now());
  const auto found = places_.find(token);
  return found == places_.end() ? nullptr : &found->second;
}

std::vector<std::shared_ptr<const Clip>> SessionRegistry::clips_for(const ServedModel& model) const {
  std::vector<std::shared_ptr<const Clip>> clips = model.clips;
  const auto own = recordings_.clips(model.opened.rig_digest());
  clips.insert(clips.end(), own.begin(), own.end());
  return clips;
}

void SessionRegistry::end_recordings() {
  for (const auto& [name, session] : sessions_) recordings_.keep(*session);
  for (const auto& session : retired_) recordings_.keep(*session);
}

void SessionRegistry::reload(const std::string& name, std::function<void(const Status&)> done) {
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
  const auto work = [reading, read = source->second, name, pages = options_.pages] {
    try {
      ModelParts parts = read();
      reading->model = std::make_shared<const ServedModel>(name, parts.model, std::move(parts.clips),
                                                           std::move(parts.poses), pages);
      warm_up(*reading->model);
    } catch (const std::bad_alloc&) {
      until_memory([&] {
        reading->status = {StatusCode::resource_exhausted,
                           "reload: the server is out of memory (restart it)"};
      });
    } catch (const std::exception& error) {
      reading->status = without_paths("reload: cannot read model", name, error);
    }
  };
  // Beside all else: nobody waits for it but who asked.
  executor_.run(Service::background, work, [this, reading, done = std::move(done)] {
    reloading_ = false;
    if (reading->status.ok()) replace(reading->model);
    executor_.destroy_later(std::exchange(reading->model, nullptr));
    tidy_up();
    done(reading->status);
    if (reloading_ || reload_again_.empty()) return;
    reload_all([calls = std::exchange(reload_again_, {})] {
      for (const auto& call : calls) call();
    });
  });
}

// Beside the model itself, reading one makes and drops tens of MiB of small arrays, among what sessions make.
void SessionRegistry::tidy_up() noexcept {
  try {
    executor_.submit(Service::disposal, [] { platform::give_back_heap(); });  // after what is destroyed there
  } catch (const std::bad_alloc&) {
  }
}

void SessionRegistry::reload_passes(std::function<void(bool)> done) {
  if (!options_.read_passes) return done(false);
  struct Reading {
    std::vector<Pass> passes;
    std::string error;
  };
  const auto reading = std::make_shared<Reading>();
  const auto work = [reading, read = options_.read_passes] {
    try {
      reading->passes = read();
    } catch (const std::exception& error) {
      reading->error = error.what();
    }
  };
  executor_.run(Service::background, work, [this, reading, done = std::move(done)] {
    if (reading->error.empty()) {
      spdlog::info("tokens: {} read again", reading->passes.size());
      passes_->replace(all_passes(options_, std::move(reading->passes)));
    } else {
      spdlog::warn("tokens: {}; those from before are still good", reading->error);
    }
    done(reading->error.empty());
  });
}

void SessionRegistry::reload_all(std::function<void()> done) {
  if (!done) done = [] {};
  if (reloading_)
    reload_again_.push_back(std::move(done));
  else
    reload_from(0, std::move(done));
}

void SessionRegistry::reload_from(std::size_t row, std::function<void()> done) {
  if (row >= models_.size()) return done();
  const std::string name = models_[row]->summary.name();
  reload(name, [this, row, name, done = std::move(done)](const Status& status) {
    if (status.ok())
      spdlog::info("model {}: read again", name);
    else
      spdlog::warn("model {}: {}", name, status.message);
    reload_from(row + 1, done);
  });
}

void SessionRegistry::replace(std::shared_ptr<const ServedModel> model) {
  const auto old = std::find_if(models_.begin(), models_.end(),
                                [&](const auto& m) { return m->summary.name() == model->summary.name(); });
  const std::uint64_t identity = model->opened.identity();
  // The same body may have other motion.
  if ((*old)->opened.identity() == identity &&
      (*old)->opened.topology_digest() == model->opened.topology_digest()) {
    (*old)->clips = model->clips;
    return;
  }
  retired_.reserve(retired_.size() + sessions_.size());
  for (auto it = sessions_.begin(); it != sessions_.end();) {
    if (it->second->model() != *old) {
      ++it;
      continue;
    }
    it->second->retire(identity);
    retired_.push_back(it->second);
    it = sessions_.erase(it);
  }
  std::swap(*old, model);
  executor_.destroy_later(std::move(model));
  try {
    prepare_details(*old);
  } catch (const std::bad_alloc&) {  // who asks for levels has them made
  }
}

}  // namespace ecorche::server
