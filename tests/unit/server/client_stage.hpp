// SPDX-License-Identifier: Apache-2.0
// Clients without a socket: what they send is dispatched, and what they are answered is read from their
// output.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <ecorche/wire/convert.hpp>
#include "runtime/server/handlers/message_table.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::server {

/// The envelope of a frame that would be written.
inline v1::Envelope envelope_of(const wire::EncodedFrame& frame) {
  std::uint32_t bytes = 0;
  std::memcpy(&bytes, frame.head.data(), sizeof bytes);
  v1::Envelope envelope;
  EXPECT_TRUE(envelope.ParseFromArray(frame.head.data() + wire::header_bytes, static_cast<int>(bytes)));
  return envelope;
}

/// What all clients share: the toy body, on one worker.
struct ClientStage {
  explicit ClientStage(Options options = {})
      : workers(1, [](const Job& job) { job(); }),
        registry(io, workers, std::move(options), {{"toy", std::make_shared<const Model>(test::toy_model())}},
                 {}) {}
  ~ClientStage() { registry.stop(); }

  net::io_context io;
  Workers workers;
  SessionRegistry registry;
};

/// One of them.
class StageClient {
 public:
  explicit StageClient(ClientStage& stage, bool greets = true, const std::string& token = {})
      : stage_(stage),
        client_(
            std::make_shared<Client>("192.0.2.1:1000", nullptr, stage.io.get_executor(), stage.registry)) {
    if (!greets) return;
    v1::Envelope hello;
    hello.set_request_id(1);
    hello.mutable_client_hello()->set_protocol_min(1);
    hello.mutable_client_hello()->set_protocol_max(1);
    hello.mutable_client_hello()->set_token(token);
    hello_ = send(std::move(hello)).value_or(v1::Envelope()).server_hello();
  }
  ~StageClient() { close(); }
  StageClient(const StageClient&) = delete;
  StageClient& operator=(const StageClient&) = delete;

  Client& client() { return *client_; }
  const v1::ServerHello& hello() const { return hello_; }
  void close() {
    if (client_->closed()) return;
    client_->on_closed();
  }

  /// What the client is answered at once: the answer to the request, or else the last of what it is told.
  std::optional<v1::Envelope> send(v1::Envelope request, wire::Payload payload = {}) {
    const std::uint64_t id = request.request_id();
    dispatch(*client_, {.envelope = std::move(request), .payload = std::move(payload)});
    return next(id);
  }
  std::optional<v1::Envelope> next(std::uint64_t request_id = 0) {
    std::optional<v1::Envelope> found;
    while (const ClientOutput::Write* const write = client_->output().next(Clock::now(), false)) {
      v1::Envelope envelope = envelope_of(*write->frames.back());
      client_->output().written(Clock::now());
      if (request_id == 0 || !found || found->request_id() != request_id) found = std::move(envelope);
    }
    return found;
  }
  /// The next answer to a request that is made on another thread.
  std::optional<v1::Envelope> wait_for(std::uint64_t request_id) {
    const auto until = Clock::now() + std::chrono::seconds(60);
    while (Clock::now() < until) {
      stage_.io.restart();
      stage_.io.run_for(std::chrono::milliseconds(5));
      while (const ClientOutput::Write* const write = client_->output().next(Clock::now(), false)) {
        const v1::Envelope envelope = envelope_of(*write->frames.back());
        client_->output().written(Clock::now());
        if (envelope.request_id() == request_id) return envelope;
      }
    }
    return std::nullopt;
  }
  v1::ModelOpened open(const std::string& session) {
    v1::Envelope request;
    request.set_request_id(2);
    request.mutable_open_model()->set_session(session);
    return send(std::move(request)).value_or(v1::Envelope()).model_opened();
  }

 private:
  ClientStage& stage_;
  std::shared_ptr<Client> client_;
  v1::ServerHello hello_;
};

}  // namespace ecorche::server
