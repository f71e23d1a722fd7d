// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/server.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <functional>
#include <map>
#include <new>
#include <optional>
#include <thread>
#include <utility>

#include "runtime/server/handlers/connection.hpp"
#include "runtime/server/listen.hpp"
#include "runtime/server/net/newcomer_pace.hpp"
#include "runtime/server/net/tls.hpp"
#include "runtime/server/net/web.hpp"
#include "runtime/server/registry/test_hooks.hpp"
#include "runtime/server/resources/rates.hpp"
#include "runtime/server/resources/reserve.hpp"
#include "runtime/server/resources/shares.hpp"
#include "runtime/server/schedule/post_back.hpp"

namespace ecorche::server {
namespace {

// How often deadlines are looked at, at least and, where one is due, at most.
constexpr Clock::duration kTick = std::chrono::milliseconds(100);
constexpr Clock::duration kShortTick = std::chrono::milliseconds(5);
// And while somebody waits for memory that others do not let go of.
constexpr Clock::duration kRoomTick = std::chrono::milliseconds(20);
// Connections beyond the limit that may be told so at one time; the next ones are closed without a word.
constexpr std::size_t kMostRefusals = 32;
// After so long without a hello a connection makes way for the next one, where there is no room for both. A
// hello comes with the first packets, after TLS or a WebSocket's handshake one or two ways there and back
// later; and the longer this is, the fewer connections a second keep all others out: here 2560 of 256 places,
// and a port lets in 2000.
constexpr Clock::duration kTimeToGreet = std::chrono::milliseconds(100);

// Of the token that a request had; null: none.
using Shown = std::shared_ptr<const Pass>;

}  // namespace

struct Server::Impl {
  Impl(Options options, std::vector<NamedModel> models, Workers& workers_, TestHooks hooks)
      : workers(workers_), wrap(hooks.transport) {
    check_options(options);
    start_listening(acceptor, endpoint_of(options.listen, options), options.listen.passed);
    port = acceptor.local_endpoint().port();
    if (options.http) {
      start_listening(http_acceptor, endpoint_of(*options.http, options), options.http->passed,
                      options.http_more_ports);
      http_port = http_acceptor.local_endpoint().port();
    }
    carrier = std::make_unique<Carrier>(options.certificate, options.key);
    web_context = {
        .origins = options.origins,
        .tls = !options.certificate.empty(),
        .hosts = options.http ? HostList(http_acceptor.local_endpoint().address(), options.host_names)
                              : HostList(),
        .viewer = options.viewer,
        .header_bytes = options.limits.hello_bytes,
        .messages_per_second = options.limits.messages_per_second,
        .ready = [this] { return !stopping && !drained_at; },
        .metrics = [this] { return metrics(); },
        .denied = [this] { registry->metrics().denied(); },
        .admit = [this](WebKind kind, const std::string& peer) { return admit(kind, peer); },
        .welcome = [this](
                       std::unique_ptr<Transport> transport, std::string peer,
                       Shown pass) { welcome(std::move(transport), std::move(peer), std::move(pass), {}); }};
    registry = std::make_unique<SessionRegistry>(io, workers, std::move(options), std::move(models),
                                                 std::move(hooks));
    web_context.passes = registry->shared_passes();
  }

  net::awaitable<void> accept(tcp::acceptor& at, bool http);
  net::awaitable<void> watch();
  net::awaitable<void> pause(net::steady_timer& timer, Clock::duration time = kTick);
  bool admit(WebKind kind, const std::string& peer);
  Clock::duration look_after(Clock::time_point now);
  void receive(tcp::socket socket, bool http);
  void welcome(std::unique_ptr<Transport> transport, std::string peer, Shown pass, Clock::duration waited);
  bool make_way(Clock::time_point now, const std::string& address);
  bool admit_request(Clock::time_point now);
  void drop_unread(Clock::time_point now, Clock::duration patience);
  void begin_stop();
  void begin_shutdown();
  void without_memory();
  std::string metrics();

  // Destroyed last: everything below it posts to it.
  net::io_context io{1};
  tcp::acceptor acceptor{io}, http_acceptor{io};
  net::steady_timer tick{io};
  Workers& workers;
  std::function<std::unique_ptr<Transport>(std::unique_ptr<Transport>)> wrap;
  std::uint16_t port = 0, http_port = 0;
  std::unique_ptr<Carrier> carrier;
  WebContext web_context;
  std::unique_ptr<SessionRegistry> registry;
  std::vector<std::shared_ptr<Connection>> connections;
  std::vector<std::shared_ptr<WebRequest>> requests;
  Reserve* reserve = nullptr;                   ///< while it runs
  std::optional<Clock::time_point> drained_at;  ///< then the shutdown begins
  bool stopping = false;
  std::map<WebKind, Rates> admitted;  ///< requests
};

Server::Server(Options options, std::vector<NamedModel> models, Workers& workers)
    : Server(std::move(options), std::move(models), workers, TestHooks{}) {}

Server::Server(Options options, std::vector<NamedModel> models, Workers& workers, TestHooks hooks)
    : impl_(std::make_unique<Impl>(std::move(options), std::move(models), workers, std::move(hooks))) {}

Server::~Server() = default;

std::uint16_t Server::port() const {
  return impl_->port;
}

std::uint16_t Server::http_port() const {
  return impl_->http_port;
}

void Server::run() {
  Reserve reserve;
  impl_->reserve = &reserve;
  net::co_spawn(impl_->io, impl_->accept(impl_->acceptor, false), net::detached);
  if (impl_->http_port != 0)
    net::co_spawn(impl_->io, impl_->accept(impl_->http_acceptor, true), net::detached);
  net::co_spawn(impl_->io, impl_->watch(), net::detached);
  while (true) {
    try {
      impl_->io.run();
      break;
    } catch (const std::exception& error) {
      // What was being done is lost; its connection will meet its deadlines.
      spdlog::error("server: {}", error.what());
    }
  }
  // A worker may still be on its way out of posting.
  impl_->workers.drain();
}

void Server::stop() {
  post_back(impl_->io, [this] { impl_->begin_stop(); });
}

void Server::reload(std::function<void()> done) {
  post_back(impl_->io, [this, done = std::move(done)]() mutable {
    spdlog::info("asked to read the models again");
    impl_->registry->reload_passes([this, done = std::move(done)](bool others) mutable {
      for (const auto& connection : impl_->connections)
        if (others) connection->check_pass();
      impl_->registry->reload_all(std::move(done));
    });
  });
}

net::awaitable<void> Server::Impl::accept(tcp::acceptor& at, bool http) {
  boost::system::error_code ec;
  net::steady_timer next(io);
  NewcomerPace pace;
  at.non_blocking(true, ec);
  while (at.is_open()) {
    bool failed = false;
    try {
      tcp::socket socket = at.accept(ec);
      if (ec == net::error::would_block || ec == net::error::try_again) {
        pace.nobody();
        socket = co_await at.async_accept(quietly(ec));
      }
      if (!at.is_open()) co_return;
      if (!ec) receive(std::move(socket), http);
      failed = static_cast<bool>(ec);
      // Out of file descriptors, or the client is gone already: neither ends the server.
      if (ec) registry->journal().line(spdlog::level::warn, "accept: " + ec.message());
    } catch (const std::exception& error) {
      registry->journal().line(spdlog::level::warn, std::string("accept: ") + error.what());
      failed = true;
    }
    try {
      co_await pause(next, failed ? kTick : pace.after(Clock::now()));
    } catch (const std::bad_alloc&) {
      without_memory();
    }
  }
}

void Server::Impl::receive(tcp::socket socket, bool http) {
  std::string peer = peer_of(socket);
  const Clock::duration in_kernel = waited(socket);
  std::unique_ptr<Transport> transport;
  {
    const MayFail may_fail;  // then it is hung up
    transport = carrier->carry(std::move(socket));
    if (wrap) transport = wrap(std::move(transport));
  }
  if (!http) {
    welcome(std::move(transport), std::move(peer), nullptr, in_kernel);
  } else if (!admit_request(Clock::now())) {
    registry->metrics().hit("connections");
  } else {
    {
      const MayFail may_fail;
      requests.push_back(web_request(std::move(transport), std::move(peer), web_context));
    }
    requests.back()->start();
  }
}

// Of requests, too, the oldest makes way.
bool Server::Impl::admit_request(Clock::time_point now) {
  std::erase_if(requests, [](const auto& request) { return request->over(); });
  if (requests.size() < registry->limits().connections) return true;
  if (now - requests.front()->born() < kTimeToGreet) return false;
  registry->metrics().hit("hello");
  requests.front()->close();
  requests.erase(requests.begin());
  return true;
}

// At most a second's worth in one go. All together are as many as the port lets in (NewcomerPace).
bool Server::Impl::admit(WebKind kind, const std::string& peer) {
  const double rate = registry->limits().requests_per_second;
  Rates& of_kind = admitted.try_emplace(kind, rate, rate).first->second;
  if (of_kind.take(address_of(peer), Clock::now())) return true;
  registry->metrics().hit("requests");
  return false;
}

void Server::Impl::welcome(std::unique_ptr<Transport> transport, std::string peer, Shown pass,
                           Clock::duration waited) {
  if (stopping) return;
  const auto limit = registry->limits().connections;
  const auto share = portion(limit, registry->limits().peer_share);
  const std::string address = address_of(peer);
  std::size_t alive = 0, own = 0;
  for (const auto& c : connections) {
    if (c->closed() || c->ending()) continue;
    ++alive;
    own += c->address() == address ? 1 : 0;
  }
  const bool beyond = own >= share;
  bool let_in = alive < limit && !beyond;
  if (!let_in) let_in = make_way(Clock::now(), beyond ? address : std::string());
  std::erase_if(connections, [](const auto& c) { return c->closed(); });
  if (!let_in) registry->metrics().hit("connections");
  if (connections.size() >= limit + kMostRefusals) return;
  {
    const MayFail may_fail;  // as in receive()
    connections.push_back(std::make_shared<Connection>(std::move(transport), std::move(peer), std::move(pass),
                                                       waited, *registry));
  }
  if (let_in) return connections.back()->start();
  connections.back()->start_refused(
      {StatusCode::resource_exhausted, "connection: " + std::to_string(beyond ? own : alive) + " clients " +
                                           (beyond ? "of your address " : "") +
                                           "are connected (try again later)"});
}

// Of those who read nothing, whoever holds most: the longest queue is pushed out (Wei, Coyle, Hsiao 1991), if
// it is longer than half of what each would have of the memory. One at a time: its bytes are given back soon.
void Server::Impl::drop_unread(Clock::time_point now, Clock::duration patience) {
  std::uint64_t most = registry->memory().limit() / (2 * std::max<std::size_t>(connections.size(), 1));
  Connection* longest = nullptr;
  for (const auto& connection : connections) {
    const std::uint64_t bytes = connection->unread(now, patience);
    if (bytes <= most) continue;
    most = bytes;
    longest = connection.get();
  }
  if (longest) longest->drop_unread();
}

// The oldest connection that had time for a hello, and sent none; with an address, the oldest of its.
bool Server::Impl::make_way(Clock::time_point now, const std::string& address) {
  const auto silent = std::find_if(connections.begin(), connections.end(), [&](const auto& c) {
    return c->awaits_hello() && now - c->accepted_at() >= kTimeToGreet &&
           (address.empty() || c->address() == address);
  });
  if (silent == connections.end()) return false;
  // Whoever is told why stays for a moment.
  (*silent)->evict(connections.size() + 1 < registry->limits().connections + kMostRefusals);
  return true;
}

// Deadlines, ended sessions and, once stopping, the end of the last connection.
net::awaitable<void> Server::Impl::watch() {
  boost::system::error_code ec;
  while (!stopping || !connections.empty()) {
    Clock::duration next = kTick;
    try {
      next = look_after(Clock::now());
    } catch (const std::exception& error) {
      spdlog::error("server: {}", error.what());
    }
    try {
      co_await pause(tick, next);
    } catch (const std::bad_alloc&) {
      without_memory();
    }
  }
  registry->end_recordings();
  // Until the last client had its goodbye, the HTTP port tells that the server stops.
  http_acceptor.close(ec);
  for (const auto& request : requests) request->close();
}

// How long until a deadline could be broken.
Clock::duration Server::Impl::look_after(Clock::time_point now) {
  Clock::duration next = kTick;
  if (drained_at && now >= *drained_at) begin_shutdown();
  for (const auto& connection : connections) next = std::min(next, connection->check(now));
  std::erase_if(connections, [](const auto& c) { return c->closed(); });
  for (const auto& request : requests) {
    const Limits& limits = registry->limits();
    const double most = request->sending() ? limits.stall_seconds : limits.hello_seconds;
    const Clock::duration left = duration(most) - (now - request->moved());
    if (left > Clock::duration::zero()) {
      next = std::min(next, left);
      continue;
    }
    if (!request->over()) registry->metrics().hit(request->sending() ? "stall" : "hello");
    request->close();
  }
  std::erase_if(requests, [](const auto& request) { return request->over(); });
  if (const auto patience = registry->patience(now)) {
    drop_unread(now, *patience);
    next = std::min(next, kRoomTick);
  }
  registry->sweep(now);
  if (const std::size_t used = reserve->refill())
    registry->journal().line(spdlog::level::warn,
                             "out of memory: " + std::to_string(used * Reserve::piece_bytes / 1024) +
                                 " KiB of what is put by for that were used");
  return std::max(next, kShortTick);
}

std::string Server::Impl::metrics() {
  Metrics& figures = registry->metrics();
  figures.set_clients(static_cast<std::size_t>(
      std::count_if(connections.begin(), connections.end(), [](const auto& c) { return !c->closed(); })));
  figures.set_sessions(registry->sessions());
  figures.set_memory(registry->memory().bytes(), registry->memory().kept());
  return figures.text();
}

// Clients go on, and newcomers come in, until who asks /readyz has had time to send them elsewhere.
void Server::Impl::begin_stop() {
  const double patience = registry->options().drain_seconds;
  if (patience <= 0 || stopping) return begin_shutdown();
  if (drained_at) return;
  spdlog::info("draining: {} connections have {} s", connections.size(), patience);
  drained_at = Clock::now() + duration(patience);
}

void Server::Impl::begin_shutdown() {
  if (std::exchange(stopping, true)) return;
  spdlog::info("stopping: {} connections", connections.size());
  registry->stop();
  boost::system::error_code ec;
  acceptor.close(ec);
  tick.cancel();
  for (const auto& connection : connections) {
    if (connection->closed()) continue;
    try {
      connection->say_goodbye({StatusCode::unavailable, "the server stops (connect again later)"});
    } catch (const std::exception&) {  // no memory for a word
      connection->close("stopping");
    }
  }
}

// Not even the reserve has enough to wait: what others let go of fills it.
void Server::Impl::without_memory() {
  std::this_thread::sleep_for(std::chrono::milliseconds(1));
  reserve->refill();
}

// So long, or not at all where even the wait finds no memory.
net::awaitable<void> Server::Impl::pause(net::steady_timer& timer, Clock::duration time) {
  boost::system::error_code ec;
  try {
    timer.expires_after(stopping ? kShortTick : time);
    co_await registry->wait(timer, ec);
  } catch (const std::exception& error) {
    spdlog::error("server: {}", error.what());
  }
}

}  // namespace ecorche::server
