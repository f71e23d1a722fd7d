// SPDX-License-Identifier: Apache-2.0
// A server of the toy body on a free loopback port, and clients that are easy to hold.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <ecorche/client/client.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/values/pose.hpp>
#include "runtime/server/registry/test_hooks.hpp"
#include "runtime/server/server.hpp"

namespace ecorche::server {

/// A clip of 20 poses, 100 a second, that turns the second joint of the toy body by 0.01 more each time.
Clip turning_clip(const Model& model);

/// Serves the toy body as `toy`, with the clip `turning`, and the same under `twin`, until destroyed.
class TestServer {
 public:
  explicit TestServer(const Limits& limits = {}, const Model& model = toy());
  /// Listens on free ports, whatever the options say of them.
  explicit TestServer(Options options, TestHooks hooks = {}, const Model& model = toy());
  ~TestServer();

  wire::Address address() const { return {"127.0.0.1", server_->port()}; }
  wire::Address http() const { return {"127.0.0.1", server_->http_port()}; }
  const Model& model() const { return *model_; }
  void stop() { server_->stop(); }
  void reload(std::function<void()> done) { server_->reload(std::move(done)); }
  /// What ReloadModel of `toy` reads from now on; the same model before.
  void reads(std::function<ModelParts()> read);
  /// Waits for run() to return.
  void join();

  /// Called on the threads of every server: before it serves, and before each job of its poses. To be set
  /// while there is none.
  static inline std::function<void()> on_its_threads;

 private:
  static Model toy();

  std::shared_ptr<const Model> model_;
  std::mutex mutex_;
  std::function<ModelParts()> read_;
  Workers workers_;
  std::shared_ptr<Server> server_;
  std::thread thread_;
};

/// With a port for browsers, too.
inline Options with_http() {
  Options options;
  options.http = Endpoint{};
  return options;
}

inline v1::Envelope claim() {
  v1::Envelope envelope;
  envelope.mutable_claim_control();
  return envelope;
}

inline v1::Envelope record(bool on, const std::string& name = {}) {
  v1::Envelope envelope;
  envelope.mutable_record()->set_on(on);
  envelope.mutable_record()->set_name(name);
  return envelope;
}

inline bool starts(const std::string& text, const std::string& with) {
  return text.rfind(with, 0) == 0;
}

inline bool says(const std::string& text, const std::string& what) {
  return text.find(what) != std::string::npos;
}

/// A client with the toy body open.
class TestClient {
 public:
  explicit TestClient(const TestServer& server, const std::string& session = {},
                      const client::Access& access = {})
      : TestClient(server.address(), session, access) {}
  explicit TestClient(const wire::Address& address, const std::string& session = {},
                      const client::Access& access = {});

  const v1::ModelOpened& opened() const { return opened_; }
  client::Client& client() { return client_; }

  std::uint32_t subscribe_mesh(const std::vector<std::string>& tissues = {}, bool quality = false);
  std::uint32_t subscribe_volume(const std::string& name, bool nearest = false);
  /// The rest pose with its second joint turned by `angle` about z.
  Pose bent(double angle) const;
  void send(std::uint64_t sequence, const Pose& pose);
  /// The update that send() sends, to be spoilt.
  v1::Envelope update(std::uint64_t sequence, const Pose& pose) const;

  /// The next message for which `wanted` holds; others are dropped. Fails the test after some seconds.
  template <class Wanted>
  wire::Frame next(Wanted&& wanted) {
    const auto until = client::Clock::now() + std::chrono::seconds(60);
    while (auto frame = client_.receive(until)) {
      if (wanted(frame->envelope)) return std::move(*frame);
    }
    throw Error(ErrorKind::internal, "test", "the message did not come", "see the test");
  }
  wire::Frame next_mesh(std::uint64_t sequence) {
    return next([=](const v1::Envelope& e) {
      return e.has_mesh_frame() && e.mesh_frame().pose_sequence() == sequence;
    });
  }
  v1::PoseAck next_ack() {
    return next([](const v1::Envelope& e) { return e.has_pose_ack(); }).envelope.pose_ack();
  }

 private:
  client::Client client_;
  v1::ModelOpened opened_;
};

/// What a client says first.
v1::Envelope greeting();

/// A socket without manners. Reads what the server says; null once it hung up or said nothing for `seconds`.
class RawClient {
 public:
  explicit RawClient(const TestServer& server);

  void send(const std::string& bytes);
  void send(const v1::Envelope& envelope, std::shared_ptr<const wire::Payload> payload = nullptr);
  void send_hello();
  std::optional<wire::Frame> receive(double seconds = 60);
  /// The code of the Status that ends the connection, and that it then ends; `unknown` when none came.
  StatusCode last_words();
  /// The server hung up within the time.
  bool hung_up(double seconds = 60);

 private:
  client::Socket socket_;
  wire::FrameReader reader_;
};

/// What a call fails with; Error{internal} when it does not.
ErrorKind error_of_call(client::Client& client, const v1::Envelope& request);

}  // namespace ecorche::server
