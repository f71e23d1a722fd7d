// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/server.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <set>
#include <utility>

#include "runtime/server/connection.hpp"

namespace ecorche::server {
namespace {

// How often deadlines are looked at.
constexpr auto kTick = std::chrono::milliseconds(100);
// Connections beyond the limit that may be told so at one time; the next ones are closed without a word.
constexpr std::size_t kMostRefusals = 32;

tcp::endpoint endpoint_of(const Options& options) {
  boost::system::error_code ec;
  const net::ip::address address =
      net::ip::make_address(options.host == "localhost" ? "127.0.0.1" : options.host, ec);
  if (ec)
    throw Error(ErrorKind::usage, "listen", "'" + options.host + "' is no address",
                "use a numeric one such as 127.0.0.1:7070");
  if (!address.is_loopback() && !options.insecure) {
    throw Error(ErrorKind::refused, options.host, "is reachable by others, and nothing is encrypted yet",
                "listen on 127.0.0.1 and tunnel, or add --insecure on a network that you trust");
  }
  return {address, options.port};
}

void bind(tcp::acceptor& acceptor, const tcp::endpoint& endpoint) {
  boost::system::error_code ec;
  const std::string where = endpoint.address().to_string() + ":" + std::to_string(endpoint.port());
  const auto check = [&] {
    if (!ec) return;
    if (ec == net::error::address_in_use) {
      throw Error(ErrorKind::temporary, where, "the address is in use",
                  "stop the other server, or --listen on another port; 0 picks a free one");
    }
    throw Error(ErrorKind::usage, where, "cannot listen: " + ec.message(),
                "use an address of this machine and a port that you may use");
  };
  acceptor.open(endpoint.protocol(), ec);
  check();
  acceptor.set_option(tcp::acceptor::reuse_address(true), ec);
  check();
  acceptor.bind(endpoint, ec);
  check();
  acceptor.listen(net::socket_base::max_listen_connections, ec);
  check();
}

std::vector<std::shared_ptr<const ServedModel>> serve_all(std::vector<NamedModel> models,
                                                          const Limits& limits) {
  if (models.empty() || models.size() > limits.models) {
    throw Error(ErrorKind::config, "models", std::to_string(models.size()) + " are given",
                "serve 1 to " + std::to_string(limits.models) + ", or raise --max-models");
  }
  std::set<std::string> names;
  std::vector<std::shared_ptr<const ServedModel>> served;
  for (NamedModel& model : models) {
    if (!names.insert(model.name).second) {
      throw Error(ErrorKind::config, model.name, "two models have this name", "rename one of the files");
    }
    served.push_back(std::make_shared<const ServedModel>(model.name, std::move(model.model)));
  }
  return served;
}

}  // namespace

struct Server::Impl {
  Impl(Options options, std::vector<NamedModel> models, Workers& workers_) : workers(workers_) {
    bind(acceptor, endpoint_of(options));
    port = acceptor.local_endpoint().port();
    auto served = serve_all(std::move(models), options.limits);
    house = std::make_unique<House>(io, workers, std::move(options), std::move(served));
  }

  net::awaitable<void> accept();
  net::awaitable<void> watch();
  void welcome(tcp::socket socket);
  void begin_shutdown();

  // Destroyed last: everything below it posts to it.
  net::io_context io{1};
  tcp::acceptor acceptor{io};
  net::steady_timer tick{io};
  net::steady_timer retry{io};
  Workers& workers;
  std::uint16_t port = 0;
  std::unique_ptr<House> house;
  std::vector<std::shared_ptr<Connection>> connections;
  bool stopping = false;
};

Server::Server(Options options, std::vector<NamedModel> models, Workers& workers)
    : impl_(std::make_unique<Impl>(std::move(options), std::move(models), workers)) {}

Server::~Server() = default;

std::uint16_t Server::port() const {
  return impl_->port;
}

void Server::run() {
  net::co_spawn(impl_->io, impl_->accept(), net::detached);
  net::co_spawn(impl_->io, impl_->watch(), net::detached);
  impl_->io.run();
  // A worker may still be on its way out of posting.
  impl_->workers.drain();
}

void Server::stop() {
  net::post(impl_->io, [this] { impl_->begin_shutdown(); });
}

net::awaitable<void> Server::Impl::accept() {
  boost::system::error_code ec;
  while (!stopping) {
    tcp::socket socket = co_await acceptor.async_accept(quietly(ec));
    if (stopping) co_return;
    if (!ec) {
      welcome(std::move(socket));
      continue;
    }
    // Out of file descriptors, or the client is gone already: neither ends the server.
    spdlog::warn("accept: {}", ec.message());
    retry.expires_after(kTick);
    co_await retry.async_wait(quietly(ec));
  }
}

void Server::Impl::welcome(tcp::socket socket) {
  const auto limit = house->limits().connections;
  const auto alive = static_cast<std::size_t>(std::count_if(
      connections.begin(), connections.end(), [](const auto& c) { return !c->closed() && !c->ending(); }));
  std::erase_if(connections, [](const auto& c) { return c->closed(); });
  if (connections.size() >= limit + kMostRefusals) return;
  connections.push_back(std::make_shared<Connection>(std::move(socket), *house));
  if (alive < limit) return connections.back()->start();
  connections.back()->start_refused(
      {StatusCode::resource_exhausted,
       "connection: " + std::to_string(limit) + " clients are connected (try again later)"});
}

// Deadlines, ended sessions and, once stopping, the end of the last connection.
net::awaitable<void> Server::Impl::watch() {
  boost::system::error_code ec;
  while (!stopping || !connections.empty()) {
    const auto now = Clock::now();
    for (const auto& connection : connections) connection->check(now);
    std::erase_if(connections, [](const auto& c) { return c->closed(); });
    house->sweep(now);
    tick.expires_after(kTick);
    co_await tick.async_wait(quietly(ec));
  }
}

void Server::Impl::begin_shutdown() {
  if (std::exchange(stopping, true)) return;
  spdlog::info("stopping: {} connections", connections.size());
  boost::system::error_code ec;
  acceptor.close(ec);
  retry.cancel();
  for (const auto& connection : connections) {
    if (!connection->closed())
      connection->say_goodbye({StatusCode::unavailable, "the server stops (connect again later)"});
  }
}

}  // namespace ecorche::server
