// SPDX-License-Identifier: Apache-2.0
#include "bench/server/attacks.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <ecorche/client/client.hpp>
#include <ecorche/values/error.hpp>
#include <ecorche/wire/framing.hpp>
#include "bench/server/served.hpp"
#include "bench/server/walking.hpp"
#include "bench/table.hpp"

namespace ecorche::bench {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kRenewed{
    2400};                        // before a client that stalls is dropped where frames crowd the memory
constexpr double kFlood = 1500;   // requests a second
constexpr double kPatience = 10;  // seconds

double since(Clock::time_point start) {
  return 1e3 * std::chrono::duration<double>(Clock::now() - start).count();
}

// A socket with a deadline for each call; closed at its end.
class Plain {
 public:
  explicit Plain(const wire::Address& to) : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(to.port);
    inet_pton(AF_INET, to.host.c_str(), &address.sin_addr);
    const timeval most{.tv_sec = static_cast<time_t>(kPatience), .tv_usec = 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &most, sizeof most);
    setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &most, sizeof most);
    open_ = connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~Plain() { close(fd_); }
  Plain(const Plain&) = delete;
  Plain& operator=(const Plain&) = delete;

  bool say(const std::string& bytes) const {
    return open_ && send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  // The first bytes of the answer.
  std::string hear() const {
    char bytes[1024];
    const ssize_t n = recv(fd_, bytes, sizeof bytes, 0);
    return {bytes, static_cast<std::size_t>(std::max<ssize_t>(n, 0))};
  }

 private:
  int fd_;
  bool open_ = false;
};

// As many planes of 4096 x 4096 pixels as a frame may hold, and all that one may ask for, of the model's
// first volume.
std::string asks_for_much(const std::string& volume, int slices) {
  v1::Envelope hello, open, subscribe;
  hello.mutable_client_hello()->set_protocol_min(1);
  hello.mutable_client_hello()->set_protocol_max(1);
  open.mutable_open_model()->set_without_triangles(true);
  v1::VolumeSelection& want = *subscribe.mutable_subscribe()->mutable_volume();
  want.set_volume(volume);
  for (int i = 0; i < slices; ++i) {
    v1::Slice& slice = *want.add_slices();
    slice.mutable_origin()->set_z(i);
    slice.mutable_u()->set_x(0.1);
    slice.mutable_v()->set_y(0.1);
    slice.set_size_u(4096);
    slice.set_size_v(4096);
  }
  return wire::encode(hello).head + wire::encode(open).head + wire::encode(subscribe).head;
}

// Runs on a thread of its own until it is destroyed.
class Attack {
 public:
  explicit Attack(std::function<void(const std::atomic<bool>&)> what)
      : thread_([this, what = std::move(what)] { what(stop_); }) {}
  ~Attack() {
    stop_ = true;
    thread_.join();
  }
  Attack(const Attack&) = delete;
  Attack& operator=(const Attack&) = delete;

 private:
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

void never_read(const wire::Address& server, const std::string& much, int count,
                const std::atomic<bool>& stop) {
  std::vector<std::unique_ptr<Plain>> held(static_cast<std::size_t>(count));
  for (std::size_t i = 0; !stop; i = (i + 1) % held.size()) {
    held[i] = std::make_unique<Plain>(server);
    held[i]->say(much);
    std::this_thread::sleep_for(kRenewed / count);
  }
}

void flood(const wire::Address& server, const std::atomic<bool>& stop) {
  auto next = Clock::now();
  while (!stop) {
    const Plain request(server);
    request.say("GET / HTTP/1.1\r\nHost: bench\r\n\r\n");
    request.hear();
    next += std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * 4 / kFlood));  // four threads
    std::this_thread::sleep_until(next);
  }
}

struct Seen {
  std::vector<double> frame_ms, socket_ms, health_ms;
  int failed = 0;
  double most_mib = 0;
};

double first_frame(const wire::Address& server) {
  const auto start = Clock::now();
  client::Client client(server, "bench");
  v1::Envelope open, subscribe;
  open.mutable_open_model()->set_without_triangles(true);
  client.call(open);
  subscribe.mutable_subscribe()->mutable_mesh();
  client.call(subscribe);
  const auto until = start + std::chrono::seconds(static_cast<int>(kPatience));
  while (const auto frame = client.receive(until)) {
    if (frame->envelope.has_mesh_frame()) return since(start);
  }
  throw Error(ErrorKind::temporary, "bench", "no first frame came", "see the server");
}

double asked(const wire::Address& server, const std::string& request, const std::string& answer) {
  const auto start = Clock::now();
  const Plain web(server);
  if (!web.say(request) || web.hear().rfind(answer, 0) != 0)
    throw Error(ErrorKind::temporary, "bench", "not answered by " + answer, "see the server");
  return since(start);
}

Seen look(const Served& served, double seconds) {
  Seen seen;
  const auto until =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  const auto note = [&](std::vector<double>& into, auto&& what) {
    try {
      into.push_back(what());
    } catch (const Error&) {
      ++seen.failed;
    }
  };
  while (Clock::now() < until) {
    note(seen.frame_ms, [&] { return first_frame(served.address()); });
    note(seen.health_ms, [&] {
      return asked(served.http(), "GET /healthz HTTP/1.1\r\nHost: bench\r\n\r\n", "HTTP/1.1 200");
    });
    note(seen.socket_ms, [&] {
      return asked(served.http(),
                   "GET /v1 HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                   "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
                   "Sec-WebSocket-Protocol: ecorche.v1\r\n\r\n",
                   "HTTP/1.1 101");
    });
    seen.most_mib = std::max(seen.most_mib, served.rss_mib());
    std::this_thread::sleep_for(milliseconds(50));
  }
  return seen;
}

void add(const Table& table, const std::string& what, const Seen& seen) {
  std::vector<std::string> cells{what, std::to_string(seen.frame_ms.size())};
  for (const auto* ms : {&seen.frame_ms, &seen.socket_ms, &seen.health_ms}) {
    cells.push_back(fixed(quantile(*ms, 0.5), 1));
    cells.push_back(fixed(ms->empty() ? 0 : *std::max_element(ms->begin(), ms->end()), 1));
  }
  cells.push_back(std::to_string(seen.failed));
  cells.push_back(fixed(seen.most_mib, 0));
  table.row(cells);
}

}  // namespace

void attacks(const std::string& program, const std::string& model, double seconds) {
  const Table table({{"attack", 48},
                     {"newcomers"},
                     {"first frame p50 ms (wanted: 100)"},
                     {"most"},
                     {"WebSocket p50 ms"},
                     {"most"},
                     {"/healthz p50 ms"},
                     {"most"},
                     {"failed (wanted: 0)"},
                     {"MiB"}});
  const auto row = [&](const std::string& what,
                       const std::function<void(const Served&, const std::atomic<bool>&)>& attack,
                       int threads) {
    const Served served(program, model, {"--http", "127.0.0.1:0"});
    first_frame(served.address());
    std::this_thread::sleep_for(std::chrono::seconds(1));
    std::vector<std::unique_ptr<Attack>> attacking;
    for (int i = 0; i < threads; ++i)
      attacking.push_back(
          std::make_unique<Attack>([&](const std::atomic<bool>& stop) { attack(served, stop); }));
    if (threads > 0) std::this_thread::sleep_for(std::chrono::seconds(1));
    add(table, what, look(served, seconds));
  };
  row(
      "none", [](const Served&, const std::atomic<bool>&) {}, 0);
  for (const int slices : {16, 8, 1}) {
    for (const int count : {2, 12, 40}) {
      row(
          std::to_string(count) + " that never read " + std::to_string(slices) + " planes of 4096 x 4096",
          [&](const Served& served, const std::atomic<bool>& stop) {
            client::Client client(served.address(), "bench");
            v1::Envelope open;
            open.mutable_open_model()->set_without_triangles(true);
            const std::string volume = client.call(open).envelope.model_opened().volumes(0).name();
            never_read(served.address(), asks_for_much(volume, slices), count, stop);
          },
          1);
    }
  }
  row(
      "1500 HTTP requests a second",
      [](const Served& served, const std::atomic<bool>& stop) { flood(served.http(), stop); }, 4);
}

}  // namespace ecorche::bench
