// SPDX-License-Identifier: Apache-2.0
// Coming back to subscriptions whose streams take long to make.
#include <algorithm>
#include <atomic>
#include <functional>
#include <map>

#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

using std::chrono::milliseconds;

// As long as it lives, or until release(), nothing is made on the thread that gives way: it reads `toy`.
class Busy {
 public:
  // Reads another model in the end, or none.
  explicit Busy(TestServer& server, const std::shared_ptr<const Model>& another = nullptr)
      : asks_(server.address(), "test") {
    server.reads([state = state_, another]() -> ModelParts {
      state->reads = true;
      while (!state->released) std::this_thread::sleep_for(milliseconds(1));
      if (!another) throw Error(ErrorKind::data, "toy.hdf", "is cut", "copy it again");
      return ModelParts{another};
    });
    v1::Envelope open, reload;
    open.mutable_open_model()->set_model("twin");
    asks_.call(open);
    reload.mutable_reload_model()->set_model("toy");
    asks_.send(reload);
    while (!state_->reads) std::this_thread::sleep_for(milliseconds(1));
  }
  ~Busy() { release(); }
  Busy(const Busy&) = delete;
  Busy& operator=(const Busy&) = delete;

  void release() { state_->released = true; }

 private:
  struct State {
    std::atomic<bool> reads = false, released = false;
  };
  std::shared_ptr<State> state_ = std::make_shared<State>();
  client::Client asks_;
};

std::uint32_t subscribe(TestClient& client, const std::function<void(v1::MeshSelection&)>& select) {
  v1::Envelope envelope;
  select(*envelope.mutable_subscribe()->mutable_mesh());
  return client.client().call(envelope).envelope.subscribed().subscription();
}

void coarse(v1::MeshSelection& mesh) {
  mesh.set_level(1);
}
void bottom(v1::MeshSelection& mesh) {
  mesh.mutable_region()->mutable_min()->set_z(-1000);
  mesh.mutable_region()->mutable_max()->set_z(100);
  for (auto* corner : {mesh.mutable_region()->mutable_min(), mesh.mutable_region()->mutable_max()}) {
    corner->set_x(corner == mesh.mutable_region()->mutable_min() ? -1000 : 1000);
    corner->set_y(corner->x());
  }
}
void nodes(v1::MeshSelection& mesh) {
  mesh.set_control_nodes(true);
}

std::string token_of(TestClient& client) {
  return client.client().server().resume_token();
}

// Of somebody who watched a coarse body, and is gone.
std::string left(TestServer& server, const std::string& session = {}) {
  TestClient before(server, session);
  subscribe(before, coarse);
  return token_of(before);
}

client::Access with(const std::string& token) {
  return {.authorities = {}, .token = {}, .resume_token = token};
}

// Its hello, and a ping right behind it.
void come_back(RawClient& client, const std::string& token) {
  v1::Envelope hello, ping;
  hello.mutable_client_hello()->set_protocol_min(1);
  hello.mutable_client_hello()->set_protocol_max(1);
  hello.mutable_client_hello()->set_resume_token(token);
  client.send(hello);
  ping.mutable_ping();
  client.send(ping);
}

TEST(ComingBack, WhoWaitsForStreamsWaitsAlone) {
  TestServer server;
  std::map<std::uint32_t, wire::Payload> shown;  // by subscription
  std::string token;
  {
    TestClient before(server);
    for (const auto& select : {coarse, bottom, nodes}) shown[subscribe(before, select)];
    before.send(5, before.bent(0.4));
    ASSERT_EQ(shown.size(), 3U);
    const auto missing = [](const auto& entry) { return entry.second.empty(); };
    while (std::any_of(shown.begin(), shown.end(), missing)) {
      wire::Frame frame = before.next_mesh(5);
      shown[frame.envelope.mesh_frame().subscription()] = std::move(frame.payload);
    }
    token = token_of(before);
  }
  Busy busy(server);
  RawClient back(server);
  come_back(back, token);
  EXPECT_FALSE(back.receive(0.3));
  TestClient other(server);
  other.subscribe_mesh();
  other.next_mesh(0);
  EXPECT_FALSE(back.receive(0.01));
  busy.release();

  const auto hello = back.receive();
  ASSERT_TRUE(hello);
  ASSERT_TRUE(hello->envelope.has_server_hello());
  const v1::Resumed& resumed = hello->envelope.server_hello().resumed();
  EXPECT_EQ(resumed.role(), v1::ROLE_CONTROLLER);
  EXPECT_EQ(resumed.last_sequence(), 5U);
  ASSERT_EQ(resumed.subscriptions_size(), 3);
  for (const auto& one : resumed.subscriptions()) EXPECT_EQ(one.was(), one.is());
  bool pong = false;
  std::size_t frames = 0;
  while (!pong || frames < shown.size()) {
    const auto message = back.receive();
    ASSERT_TRUE(message);
    pong = pong || message->envelope.has_pong();
    if (!message->envelope.has_mesh_frame()) continue;
    ++frames;
    EXPECT_EQ(message->envelope.mesh_frame().pose_sequence(), 5U);
    EXPECT_EQ(message->payload, shown[message->envelope.mesh_frame().subscription()]);
  }
}

TEST(ComingBack, WhatOthersWatchIsThere) {
  TestServer server;
  TestClient watches(server, "shared");
  const std::uint32_t subscription = subscribe(watches, coarse);
  std::string token;
  {
    TestClient before(server, "shared");
    EXPECT_EQ(subscribe(before, coarse), subscription);
    token = token_of(before);
  }
  const Busy busy(server);
  const client::Client back(server.address(), "test", with(token));
  ASSERT_EQ(back.server().resumed().subscriptions_size(), 1);
  EXPECT_EQ(back.server().resumed().subscriptions(0).is(), subscription);
}

// Its place waits for its next try.
TEST(ComingBack, WhoHangsUpMeanwhileDoesNotTakeItsPlace) {
  TestServer server;
  const std::string token = left(server);
  Busy busy(server);
  {
    RawClient impatient(server);
    come_back(impatient, token);
    EXPECT_FALSE(impatient.receive(0.1));
  }
  RawClient again(server);
  come_back(again, token);
  EXPECT_FALSE(again.receive(0.3));  // the other one has been seen to be gone
  busy.release();
  const auto hello = again.receive();
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->envelope.server_hello().resumed().subscriptions_size(), 1);
  EXPECT_EQ(hello->envelope.server_hello().resumed().role(), v1::ROLE_CONTROLLER);
}

// Of two who show the token at once, and of a session whose model has become another one.
TEST(ComingBack, WhatIsNoMoreDoesNotComeBack) {
  TestServer server;
  const auto resumed = [](RawClient& client) {
    const auto hello = client.receive();
    return hello && hello->envelope.has_server_hello() && hello->envelope.server_hello().has_resumed();
  };
  const std::string token = left(server);
  RawClient first(server), second(server);
  {
    const Busy busy(server);
    come_back(first, token);
    EXPECT_FALSE(first.receive(0.1));
    come_back(second, token);
    EXPECT_FALSE(second.receive(0.1));
  }
  EXPECT_TRUE(resumed(first));
  EXPECT_FALSE(resumed(second));

  const TestClient watches(server, "old");  // which goes on
  const std::string late = left(server, "old");
  RawClient third(server);
  auto changed = std::make_shared<Model>(test::toy_model());
  changed->tissues[0].V.array() += 1e-3F;
  {
    const Busy busy(server, changed);
    come_back(third, late);
    EXPECT_FALSE(third.receive(0.1));
  }
  EXPECT_FALSE(resumed(third));
}

}  // namespace
}  // namespace ecorche::server
