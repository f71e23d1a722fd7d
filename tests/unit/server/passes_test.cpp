// SPDX-License-Identifier: Apache-2.0
// Tokens with rights and limits: who finds which, what each may by the table of messages, and what a change
// of them does.
#include "runtime/server/net/passes.hpp"

#include <atomic>
#include <future>
#include <mutex>

#include "tests/unit/server/client_stage.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

Pass pass_of(const std::string& token, Right right) {
  return {.name = token, .digest = digest_of(token), .right = right};
}

Options with_all_rights() {
  Options options;
  for (const Right right : {Right::watch, Right::pose, Right::manage})
    options.passes.push_back(pass_of(right_name(right), right));
  return options;
}

// An envelope with this message, of which nothing is set but what makes it need the most.
v1::Envelope neediest(const MessageRow& row) {
  const auto number = static_cast<unsigned>(row.message);
  std::string bytes;
  const unsigned tag = (number << 3U) | 2U;
  if (tag >= 128) bytes.push_back(static_cast<char>((tag & 127U) | 128U));
  bytes.push_back(static_cast<char>(tag >= 128 ? tag >> 7U : tag));
  bytes.push_back('\0');
  v1::Envelope envelope;
  EXPECT_TRUE(envelope.ParseFromString(bytes));
  if (envelope.has_solve_ik()) envelope.mutable_solve_ik()->set_apply_as(1);
  envelope.set_request_id(7);
  return envelope;
}

std::string said(const std::optional<v1::Envelope>& answer) {
  if (!answer) return {};
  return answer->has_pose_ack() ? answer->pose_ack().status().message() : answer->status().message();
}

// The slow, obvious list beside the table's.
Right right_by_hand(v1::Envelope::MessageCase message) {
  switch (message) {
    case v1::Envelope::kReloadModel:
    case v1::Envelope::kRecord:
      return Right::manage;
    case v1::Envelope::kPoseUpdate:
    case v1::Envelope::kClaimControl:
    case v1::Envelope::kAskControl:
    case v1::Envelope::kReleaseControl:
    case v1::Envelope::kGiveControl:
    case v1::Envelope::kPlayClip:
    case v1::Envelope::kSteerClip:
    case v1::Envelope::kSetThresholds:
    case v1::Envelope::kHangSpheres:
    case v1::Envelope::kSolveIk:
      return Right::pose;
    default:
      return Right::watch;
  }
}

TEST(Passes, AreFoundByTheirTokens) {
  Passes passes({pass_of("one", Right::watch), pass_of("two", Right::manage)});
  EXPECT_FALSE(passes.open());
  EXPECT_EQ(passes.find("one")->right, Right::watch);
  EXPECT_EQ(passes.find("two")->name, "two");
  for (const char* wrong : {"", "on", "onee", "One", "three"}) EXPECT_FALSE(passes.find(wrong)) << wrong;
  const Passes nobody_asks({});
  EXPECT_TRUE(nobody_asks.open());
  EXPECT_EQ(nobody_asks.find("anything")->right, Right::manage);
}

TEST(Passes, DigestsAreThoseOfSha256sum) {
  // printf %s abc | sha256sum
  const std::string abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
  EXPECT_EQ(digest_from_hex(abc), digest_of("abc"));
  EXPECT_EQ(digest_from_hex("BA7816BF8F01CFEA414140DE5DAE2223B00361A396177A9CB410FF61F20015AD"),
            digest_of("abc"));
  EXPECT_FALSE(digest_from_hex(abc.substr(1)));
  EXPECT_FALSE(digest_from_hex(abc + "0"));
  EXPECT_FALSE(digest_from_hex("g" + abc.substr(1)));
  for (const Right right : {Right::watch, Right::pose, Right::manage})
    EXPECT_EQ(right_from_name(right_name(right)), right);
  EXPECT_FALSE(right_from_name("own"));
}

TEST(Passes, EachMessageByEachRight) {
  for (const Right right : {Right::watch, Right::pose, Right::manage}) {
    ClientStage stage(with_all_rights());
    StageClient client(stage, true, right_name(right));
    ASSERT_EQ(client.hello().protocol(), 1U);
    client.open("shared");
    for (const MessageRow& row : message_table()) {
      if (!row.needs.hello || row.message == v1::Envelope::kGoodbye) continue;
      const Right needed = right_by_hand(row.message);
      const std::string text = std::string(row.name) + ": the token of this connection may only " +
                               right_name(right) + " (show one that may " + right_name(needed) + ")";
      const std::string answer = said(client.send(neediest(row)));
      if (right < needed)
        EXPECT_EQ(answer, text);
      else
        EXPECT_EQ(answer.find("the token of this connection"), std::string::npos) << answer;
    }
    EXPECT_FALSE(client.client().ending());
  }
}

TEST(Passes, WhoMayOnlyWatchGetsNoControl) {
  ClientStage stage(with_all_rights());
  StageClient watcher(stage, true, "watch");
  EXPECT_EQ(watcher.open("shared").role(), v1::ROLE_OBSERVER) << "although nobody else is there";
  StageClient poser(stage, true, "pose");
  EXPECT_EQ(poser.open("shared").role(), v1::ROLE_CONTROLLER);
  v1::Envelope give;
  give.set_request_id(8);
  give.mutable_give_control()->set_connection(watcher.client().number());
  EXPECT_EQ(said(poser.send(give)), "control: connection " + std::to_string(watcher.client().number()) +
                                        " showed a token to watch by (give it to another)");
  EXPECT_TRUE(poser.client().has_control());
}

TEST(Passes, WhoOnlyWatchesLeavesControlToWhoComesNext) {
  ClientStage stage;
  StageClient watcher(stage);
  v1::Envelope open;
  open.set_request_id(2);
  open.mutable_open_model()->set_session("shared");
  open.mutable_open_model()->set_watch(true);
  EXPECT_EQ(watcher.send(open)->model_opened().role(), v1::ROLE_OBSERVER);
  {
    StageClient poser(stage);
    EXPECT_EQ(poser.open("shared").role(), v1::ROLE_CONTROLLER);
    v1::Envelope release;
    release.set_request_id(3);
    release.mutable_release_control();
    poser.send(release);
  }
  v1::Envelope claim;
  claim.set_request_id(4);
  claim.mutable_claim_control();
  watcher.send(claim);
  EXPECT_TRUE(watcher.client().has_control()) << "it may have it where it asks";
}

TEST(Passes, OnlySoManyConnectionsOfAToken) {
  Options options = with_all_rights();
  options.passes[1].connections = 2;
  ClientStage stage(options);
  auto first = std::make_unique<StageClient>(stage, true, "pose");
  StageClient second(stage, true, "pose"), third(stage, true, "pose"), other(stage, true, "watch");
  EXPECT_EQ(second.hello().protocol(), 1U);
  EXPECT_EQ(third.hello().protocol(), 0U);
  EXPECT_TRUE(third.client().ending());
  EXPECT_EQ(other.hello().protocol(), 1U);
  first.reset();
  EXPECT_EQ(StageClient(stage, true, "pose").hello().protocol(), 1U) << "one has left";
}

TEST(Passes, SeatsStayWithTheirTokens) {
  Pass pass = pass_of("one", Right::pose);
  pass.connections = 1;
  Passes passes({pass});
  const Seat seat = passes.take_seat(pass);
  EXPECT_TRUE(seat);
  EXPECT_FALSE(passes.take_seat(pass));
  passes.replace({pass, pass_of("two", Right::watch)});
  EXPECT_FALSE(passes.take_seat(pass)) << "the one from before is still there";
}

// As SIGHUP has it: rights that are less, and none.
TEST(Passes, AChangeReachesWhoIsThere) {
  std::vector<Pass> now{pass_of("sixteen letters!", Right::pose), pass_of("sixteen letters?", Right::pose)};
  std::mutex guard;
  Options options;
  options.passes = now;
  options.read_passes = [&] {
    const std::lock_guard lock(guard);
    return now;
  };
  TestServer server(options);
  const auto access = [](const char* token) {
    return client::Access{.authorities = {}, .token = token, .resume_token = {}};
  };
  TestClient lessened(server, "a", access("sixteen letters!")),
      ended(server, "b", access("sixteen letters?"));
  {
    const std::lock_guard lock(guard);
    now = {pass_of("sixteen letters!", Right::watch), pass_of("sixteen letters.", Right::manage)};
  }
  server.reload({});
  lessened.next([](const v1::Envelope& said) {
    return said.has_control_changed() && said.control_changed().role() == v1::ROLE_OBSERVER;
  });
  try {
    ended.next([](const v1::Envelope&) { return false; });
    ADD_FAILURE() << "it is still there";
  } catch (const client::ServerError& error) {
    EXPECT_EQ(error.code(), StatusCode::unauthenticated);
    EXPECT_NE(std::string(error.what()).find("no longer good"), std::string::npos) << error.what();
  }
  EXPECT_THROW(TestClient(server, "", access("sixteen letters?")), Error);
  const TestClient newcomer(server, "", access("sixteen letters."));
}

TEST(Passes, WhatCannotBeReadChangesNothing) {
  std::atomic<int> reads = 0;
  Options options;
  options.passes = {pass_of("sixteen letters!", Right::pose)};
  options.read_passes = [&]() -> std::vector<Pass> {
    ++reads;
    throw Error(ErrorKind::config, "tokens.yaml", "is empty", "list one");
  };
  TestServer server(options);
  const client::Access access{.authorities = {}, .token = "sixteen letters!", .resume_token = {}};
  TestClient before(server, "", access);
  std::promise<void> done;
  server.reload([&] { done.set_value(); });
  done.get_future().wait();
  EXPECT_EQ(reads, 1);
  before.send(1, before.bent(0.1));
  EXPECT_EQ(before.next_ack().status().code(), 0U);
  const TestClient newcomer(server, "", access);
}

}  // namespace
}  // namespace ecorche::server
