// SPDX-License-Identifier: Apache-2.0
// What a server reads of its clients: their requests, and HTTP with the WebSockets that begin there. Neither
// has a socket; all is done on the calling thread but for what a session makes on its worker.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <ecorche/model_file/model_file.hpp>
#include "runtime/server/handlers/message_reader.hpp"
#include "runtime/server/handlers/message_table.hpp"
#include "runtime/server/net/web.hpp"
#include "tests/fuzz/promises.hpp"
#include "tests/fuzz/targets.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::fuzz {
namespace {

using namespace server;

// The toy body, served.
struct Stage {
  Stage() : workers(1, [](const Job& job) { job(); }), registry(io, workers, options(), models(), {}) {
    spdlog::set_level(spdlog::level::off);
  }
  ~Stage() { registry.stop(); }

  static Options options() {
    Options options;
    options.limits.linger_seconds = 0;
    return options;
  }
  static std::vector<NamedModel> models() {
    return {{"toy", std::make_shared<const Model>(test::toy_model())}};
  }
  void poll() {
    io.restart();
    io.poll();
  }

  const std::uint64_t rig_digest = model_file::rig_digest(test::toy_model().rig);
  net::io_context io;
  Workers workers;
  SessionRegistry registry;
};

// Everything that would be written is a frame.
void read_output(Client& client) {
  while (const ClientOutput::Write* const write = client.output().next(Clock::now(), false)) {
    for (const auto& frame : write->frames) {
      std::uint32_t bytes = 0;
      std::memcpy(&bytes, frame->head.data(), sizeof bytes);
      v1::Envelope envelope;
      must(envelope.ParseFromArray(frame->head.data() + wire::header_bytes, static_cast<int>(bytes)));
      must(envelope.message_case() != v1::Envelope::MESSAGE_NOT_SET);
    }
    client.output().written(Clock::now());
  }
}

// Brings the bytes of a client in pieces, and forgets what it is written.
class GivenTransport final : public Transport {
 public:
  GivenTransport(net::io_context& io, Bytes bytes, std::size_t piece)
      : io_(io), bytes_(bytes), piece_(piece) {}

  net::any_io_executor executor() override { return io_.get_executor(); }
  net::awaitable<void> open(boost::system::error_code& ec) override {
    ec = {};
    co_return;
  }
  net::awaitable<std::size_t> read_some(std::span<std::byte> out, boost::system::error_code& ec) override {
    const std::size_t n = closed_ ? 0 : std::min({out.size(), bytes_.size(), piece_});
    ec = n == 0 ? net::error::eof : boost::system::error_code();
    std::copy_n(bytes_.begin(), n, out.begin());
    bytes_ = bytes_.subspan(n);
    co_return n;
  }
  net::awaitable<void> write(std::span<const net::const_buffer> frame,
                             boost::system::error_code& ec) override {
    must(net::buffer_size(frame) < std::size_t{1} << 20);
    ec = {};
    co_return;
  }
  net::awaitable<void> finish(boost::system::error_code& ec) override {
    ec = {};
    co_return;
  }
  void close() override { closed_ = true; }

 private:
  net::io_context& io_;
  Bytes bytes_;
  std::size_t piece_;
  bool closed_ = false;
};

// A client that speaks WebSocket: its messages, to the end.
net::awaitable<void> read_messages(std::unique_ptr<Transport> transport) {
  MessageReader reader(kFrameLimits);
  boost::system::error_code ec;
  while (true) {
    const std::size_t n = co_await transport->read_some(reader.buffer(), ec);
    if (ec || transport->wrong_kind()) break;
    reader.on_read(n, Clock::now(), transport->message_ended());
    std::optional<wire::Frame> frame;
    Status status = reader.next(frame);
    for (; status.ok() && frame; status = reader.next(frame)) {
    }
    if (!status.ok()) break;
  }
  co_await transport->finish(ec);
  transport->close();
}

WebContext web_context(net::io_context& io) {
  WebContext context;
  context.passes =
      std::make_shared<const Passes>(std::vector<Pass>{{.name = "one", .digest = digest_of("secret")}});
  context.origins = {"http://other.example"};
  context.hosts = HostList(net::ip::make_address("127.0.0.1"), {"served.example"});
  context.messages_per_second = 1e9;
  context.ready = [] { return true; };
  context.metrics = [] { return std::string("metric 1\n"); };
  context.denied = [] {};
  context.admit = [](WebKind, const std::string&) { return true; };
  context.welcome = [&io](std::unique_ptr<Transport> transport, const std::string&,
                          const std::shared_ptr<const Pass>&) {
    net::co_spawn(io, read_messages(std::move(transport)), net::detached);
  };
  return context;
}

}  // namespace

void requests(Bytes bytes) {
  static Stage stage;
  if (bytes.empty()) return;
  // The first byte: whether a hello goes before, and a session.
  const auto first = std::to_integer<unsigned>(bytes[0]);
  bytes = bytes.subspan(1);
  const auto client =
      std::make_shared<Client>("192.0.2.1:1000", nullptr, stage.io.get_executor(), stage.registry);
  const auto send = [&](v1::Envelope request, wire::Payload payload = {}) {
    if (client->over() || client->aborted() != nullptr) return;
    // Nobody guesses a digest: 0 stands for the right one.
    if (request.has_pose_update() && request.pose_update().rig_digest() == 0)
      request.mutable_pose_update()->set_rig_digest(stage.rig_digest);
    dispatch(*client, {.envelope = std::move(request), .payload = std::move(payload)});
    stage.poll();
    read_output(*client);
  };
  if ((first & 1U) == 0) {
    v1::Envelope hello;
    hello.mutable_client_hello()->set_protocol_min(1);
    hello.mutable_client_hello()->set_protocol_max(1);
    for (const v1::Encoding encoding : {v1::ENCODING_F32, v1::ENCODING_U16, v1::ENCODING_U16_DELTA})
      hello.mutable_client_hello()->add_encodings(encoding);
    send(std::move(hello));
  }
  if ((first & 3U) == 0) {
    v1::Envelope open;
    open.set_request_id(1);
    open.mutable_open_model()->set_session("fuzzed");
    send(std::move(open));
  }
  wire::FrameReader reader(kFrameLimits);
  while (!bytes.empty()) {
    const auto into = reader.prepare();
    const std::size_t n = std::min(into.size(), bytes.size());
    std::memcpy(into.data(), bytes.data(), n);
    bytes = bytes.subspan(n);
    if (!reader.commit(n).ok()) break;
    if (!reader.complete()) continue;
    wire::Frame frame = reader.release();
    send(std::move(frame.envelope), std::move(frame.payload));
  }
  stage.workers.drain();
  stage.poll();
  read_output(*client);
  client->on_closed();
  stage.registry.sweep(Clock::now());
  stage.poll();
}

void web(Bytes bytes) {
  static net::io_context io;
  static const WebContext context = web_context(io);
  if (bytes.empty()) return;
  const std::size_t piece = 1 + std::to_integer<std::size_t>(bytes[0]);
  const auto request =
      web_request(std::make_unique<GivenTransport>(io, bytes.subspan(1), piece), "192.0.2.1:1000", context);
  request->start();
  io.restart();
  io.run();
  must(request->over());
}

}  // namespace ecorche::fuzz
