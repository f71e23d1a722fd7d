// SPDX-License-Identifier: Apache-2.0
// What handlers do to a client's place, without a socket.
#include <stdexcept>

#include "tests/unit/server/client_stage.hpp"

namespace ecorche::server {
namespace {

v1::Envelope hello_with(const std::string& resume_token) {
  v1::Envelope hello;
  hello.set_request_id(1);
  hello.mutable_client_hello()->set_protocol_min(1);
  hello.mutable_client_hello()->set_protocol_max(1);
  hello.mutable_client_hello()->set_resume_token(resume_token);
  return hello;
}

v1::Envelope solve_ik(std::uint64_t id) {
  v1::Envelope request;
  request.set_request_id(id);
  v1::IkTarget& target = *request.mutable_solve_ik()->add_targets();
  target.set_segment(2);
  target.mutable_target()->set_z(10);
  return request;
}

TEST(ClientTest, WhoShowsATokenEvictsWhoHasThePlace) {
  ClientStage stage;
  StageClient before(stage), after(stage, false);
  before.open("shared");
  const auto answer = after.send(hello_with(before.hello().resume_token()));
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->request_id(), 1U);
  EXPECT_EQ(answer->server_hello().resumed().session(), "shared");
  EXPECT_EQ(answer->server_hello().resumed().role(), v1::ROLE_CONTROLLER);
  EXPECT_TRUE(after.client().has_control());
  EXPECT_TRUE(before.client().ending());
  EXPECT_FALSE(before.client().session());
  EXPECT_EQ(before.client().output().finished_by(), CloseReason::policy);
  EXPECT_EQ(before.next()->status().code(), static_cast<std::uint32_t>(StatusCode::aborted));
  EXPECT_FALSE(before.next());
}

TEST(ClientTest, AGoodbyeLeavesNoPlace) {
  ClientStage stage;
  StageClient before(stage), after(stage, false);
  before.open("shared");
  v1::Envelope goodbye;
  goodbye.mutable_goodbye();
  EXPECT_FALSE(before.send(goodbye));
  EXPECT_STREQ(before.client().aborted(), "client said goodbye");
  before.close();
  EXPECT_FALSE(after.send(hello_with(before.hello().resume_token()))->server_hello().has_resumed());
}

TEST(ClientTest, ControlGoesFromOneToTheOther) {
  ClientStage stage;
  StageClient first(stage), second(stage);
  first.open("shared");
  second.open("shared");
  v1::Envelope release, claim;
  release.mutable_release_control();
  claim.mutable_claim_control();
  EXPECT_EQ(second.send(claim)->status().message(),
            "control: another connection holds it, or may come back to it (try again later)");
  first.send(release);
  EXPECT_FALSE(first.client().has_control());
  second.next();
  EXPECT_TRUE(second.send(claim));
  EXPECT_TRUE(second.client().has_control());
  EXPECT_EQ(first.next()->control_changed().role(), v1::ROLE_OBSERVER);
}

TEST(ClientTest, IsAnsweredWhatAWorkerFoundOnlyWhileItIsThere) {
  ClientStage stage;
  StageClient stays(stage), goes(stage);
  stays.open({});
  goes.open({});
  stays.next();
  goes.next();
  EXPECT_FALSE(goes.send(solve_ik(3)));
  EXPECT_FALSE(stays.send(solve_ik(4)));
  EXPECT_FALSE(stays.send(solve_ik(5)));
  EXPECT_EQ(stays.send(solve_ik(6))->status().message(),
            "ik: two are being solved for this connection (wait for them)");
  goes.close();
  EXPECT_TRUE(stays.wait_for(4)->has_ik_solved());
  EXPECT_TRUE(stays.wait_for(5)->has_ik_solved());
  EXPECT_EQ(stays.client().pending().ik, 0);
  EXPECT_FALSE(goes.next());
  EXPECT_FALSE(stays.send(solve_ik(7)));
  EXPECT_TRUE(stays.wait_for(7)->has_ik_solved());
}

TEST(ClientTest, WhatAHandlerThrowsEndsItAlone) {
  ClientStage stage;
  StageClient client(stage), other(stage);
  client.client().guard("message: the server failed at it (report it)",
                        [] { throw std::runtime_error("by a test"); });
  EXPECT_TRUE(client.client().ending());
  const v1::Envelope last = client.next().value();
  EXPECT_EQ(last.status().code(), static_cast<std::uint32_t>(StatusCode::internal));
  EXPECT_EQ(last.status().message(), "message: the server failed at it (report it)");
  EXPECT_FALSE(other.client().over());
  // After the end it is answered nothing.
  v1::Envelope ping;
  ping.mutable_ping();
  EXPECT_FALSE(client.send(ping));
  EXPECT_TRUE(other.send(ping));
}

TEST(ClientTest, AnswersOfACallbackComeBackToItAndItsFailuresEndIt) {
  ClientStage stage;
  StageClient client(stage);
  const auto fails = client.client().callback([](Client&, int) { throw std::runtime_error("by a test"); });
  const auto answers = client.client().callback(
      [](Client& asking, int id) { asking.answer_status(static_cast<std::uint64_t>(id), {}); });
  std::function<void(int)> call = answers;
  call(9);
  EXPECT_EQ(client.next()->request_id(), 9U);
  call = fails;
  call(9);
  EXPECT_EQ(client.next()->status().message(), "answer: the server failed at it (report it)");
}

}  // namespace
}  // namespace ecorche::server
