// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/house.hpp"

#include <algorithm>
#include <utility>

namespace ecorche::server {
namespace {

// [a-z0-9_]{1,64}
bool identifier(const std::string& name) {
  return !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  });
}

}  // namespace

House::House(net::io_context& io, Workers& workers, Options options,
             std::vector<std::shared_ptr<const ServedModel>> models, Seams seams)
    : io_(io),
      workers_(workers),
      options_(std::move(options)),
      models_(std::move(models)),
      seams_(std::move(seams)) {}

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
  if (sessions_.size() >= options_.limits.sessions) {
    metrics_.hit("sessions");
    return {StatusCode::resource_exhausted, "open: " + std::to_string(sessions_.size()) +
                                                " sessions are open (try again when one has ended)"};
  }
  out = std::make_shared<Session>(io_, workers_, *model, name, named, options_.limits);
  sessions_.emplace(name, out);
  return {};
}

void House::sweep(Clock::time_point now) {
  std::erase_if(sessions_, [&](const auto& entry) { return entry.second->over(now); });
}

}  // namespace ecorche::server
