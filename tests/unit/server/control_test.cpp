// SPDX-License-Identifier: Apache-2.0
// When control is free, who is told so, and who has the first right to it.
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

v1::Envelope open(const std::string& session) {
  v1::Envelope envelope;
  envelope.mutable_open_model()->set_model("toy");
  envelope.mutable_open_model()->set_session(session);
  return envelope;
}

v1::ControlChanged next_change(TestClient& client) {
  return client.next([](const v1::Envelope& e) { return e.has_control_changed(); })
      .envelope.control_changed();
}

// Another body under the toy's name, told to all who have it open.
void change_model(TestServer& server) {
  auto changed = std::make_shared<Model>(test::toy_model());
  changed->tissues[0].V.array() += 1e-3F;
  server.reads([changed] { return ModelParts{changed}; });
  TestClient asks(server);
  v1::Envelope reload;
  reload.mutable_reload_model()->set_model("toy");
  asks.client().call(reload);
}

Limits lingering(double seconds) {
  Limits limits;
  limits.linger_seconds = seconds;
  return limits;
}

TEST(Control, IsKeptForWhoLeftItUntilTheTimeIsOverAndAllAreTold) {
  const TestServer server(lingering(0.3));
  auto first = std::make_unique<TestClient>(server, "shared");
  TestClient second(server, "shared");
  first.reset();
  const v1::ControlChanged left = next_change(second);
  EXPECT_FALSE(left.vacant());
  EXPECT_GT(left.reserved_seconds(), 0);
  EXPECT_LE(left.reserved_seconds(), 0.3);
  const v1::ControlChanged free = next_change(second);
  EXPECT_TRUE(free.vacant());
  EXPECT_EQ(free.reserved_seconds(), 0);
  EXPECT_EQ(free.role(), v1::ROLE_OBSERVER);
  EXPECT_TRUE(second.client().call(claim()).envelope.has_control_granted());
}

TEST(Control, IsNobodyElsesWhileItIsKept) {
  const TestServer server(lingering(1000));
  auto first = std::make_unique<TestClient>(server, "shared");
  TestClient second(server, "shared");
  const std::string token = first->client().server().resume_token();
  first.reset();
  EXPECT_GT(next_change(second).reserved_seconds(), 900);
  EXPECT_EQ(error_of_call(second.client(), claim()), ErrorKind::refused);
  EXPECT_EQ(TestClient(server, "shared").opened().role(), v1::ROLE_OBSERVER);
  const client::Client back(server.address(), "test",
                            {.authorities = {}, .token = {}, .resume_token = token});
  EXPECT_EQ(back.server().resumed().role(), v1::ROLE_CONTROLLER);
  const v1::ControlChanged held = next_change(second);  // again somebody's
  EXPECT_FALSE(held.vacant());
  EXPECT_EQ(held.reserved_seconds(), 0);
}

// Nobody can come back to the place of one who said goodbye.
TEST(Control, OfWhoSaysGoodbyeIsFreeAtOnce) {
  const TestServer server(lingering(1000));
  TestClient first(server, "shared"), second(server, "shared");
  v1::Envelope goodbye;
  goodbye.mutable_goodbye();
  first.client().send(goodbye);
  EXPECT_TRUE(next_change(second).vacant());
  // Whoever opens it next has it, and the others hear of that.
  EXPECT_EQ(TestClient(server, "shared").opened().role(), v1::ROLE_CONTROLLER);
  EXPECT_FALSE(next_change(second).vacant());
}

TEST(Control, StaysItsHoldersWhenTheModelBecomesAnotherOne) {
  TestServer server(lingering(1000));
  TestClient holder(server, "shared"), other(server, "shared");
  change_model(server);
  EXPECT_EQ(other.client().call(open("shared")).envelope.model_opened().role(), v1::ROLE_OBSERVER);
  EXPECT_EQ(error_of_call(other.client(), claim()), ErrorKind::refused);
  EXPECT_EQ(TestClient(server, "shared").opened().role(), v1::ROLE_OBSERVER);
  EXPECT_EQ(holder.client().call(open("shared")).envelope.model_opened().role(), v1::ROLE_CONTROLLER);
  const v1::ControlChanged held = next_change(other);
  EXPECT_FALSE(held.vacant());
  holder.send(1, holder.bent(0.1));
  EXPECT_EQ(holder.next_ack().status().code(), 0U);
}

TEST(Control, IsFreeWhereTheHolderDoesNotOpenTheOtherModelInTime) {
  TestServer server(lingering(0.3));
  const TestClient holder(server, "shared");
  TestClient other(server, "shared");
  change_model(server);
  EXPECT_EQ(other.client().call(open("shared")).envelope.model_opened().role(), v1::ROLE_OBSERVER);
  EXPECT_TRUE(next_change(other).vacant());
  EXPECT_TRUE(other.client().call(claim()).envelope.has_control_granted());
}

// Its connection broke before the model changed: the token is what it is known by.
TEST(Control, IsItsHoldersThatComesBackToAnotherModel) {
  TestServer server(lingering(1000));
  auto holder = std::make_unique<TestClient>(server, "shared");
  TestClient other(server, "shared");
  const std::string token = holder->client().server().resume_token();
  holder.reset();
  next_change(other);
  change_model(server);
  EXPECT_EQ(TestClient(server, "shared").opened().role(), v1::ROLE_OBSERVER);
  client::Client back(server.address(), "test", {.authorities = {}, .token = {}, .resume_token = token});
  EXPECT_FALSE(back.server().has_resumed());
  EXPECT_EQ(back.call(open("shared")).envelope.model_opened().role(), v1::ROLE_CONTROLLER);
}

// The name that a session of one's own gets can be passed on, and asked for.
TEST(Sessions, TheNameThatIsGivenIsAccepted) {
  const TestServer server;
  TestClient own(server);
  own.subscribe_mesh();
  own.send(3, own.bent(0.2));
  own.next_mesh(3);
  TestClient invited(server, own.opened().session());
  EXPECT_EQ(invited.opened().session(), own.opened().session());
  EXPECT_EQ(invited.opened().role(), v1::ROLE_OBSERVER);
  invited.subscribe_mesh();
  invited.next_mesh(3);
}

}  // namespace
}  // namespace ecorche::server
