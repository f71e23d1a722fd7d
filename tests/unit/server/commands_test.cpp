// SPDX-License-Identifier: Apache-2.0
// Control, coming back, inverse kinematics, clips and thresholds.
#include <ecorche/kinematics/ik.hpp>
#include <ecorche/wire/convert.hpp>
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

v1::Envelope release() {
  v1::Envelope envelope;
  envelope.mutable_release_control();
  return envelope;
}

v1::Envelope play(const std::string& name, double speed = 0, bool loop = false) {
  v1::Envelope envelope;
  envelope.mutable_play_clip()->set_name(name);
  envelope.mutable_play_clip()->set_speed(speed);
  envelope.mutable_play_clip()->set_loop(loop);
  return envelope;
}

bool controls(const v1::Envelope& envelope) {
  return envelope.has_control_changed() && envelope.control_changed().role() == v1::ROLE_CONTROLLER;
}

TEST(Control, GoesFromOneToTheOtherAndAllAreTold) {
  const TestServer server;
  TestClient first(server, "shared"), second(server, "shared");
  first.send(7, first.bent(0.1));
  first.next_ack();
  EXPECT_EQ(error_of_call(second.client(), claim()), ErrorKind::refused);
  EXPECT_EQ(error_of_call(second.client(), release()), ErrorKind::refused);
  first.client().call(release());
  const auto vacant = [](const v1::Envelope& e) {
    return e.has_control_changed() && e.control_changed().vacant();
  };
  first.next(vacant);
  second.next(vacant);
  first.send(8, first.bent(0.2));
  EXPECT_EQ(first.next_ack().status().code(), static_cast<std::uint32_t>(StatusCode::permission_denied));

  EXPECT_EQ(second.client().call(claim()).envelope.control_granted().last_sequence(), 7U);
  second.next(controls);
  EXPECT_FALSE(first.next([](const v1::Envelope& e) { return e.has_control_changed(); })
                   .envelope.control_changed()
                   .vacant());
  second.send(7, second.bent(0.2));
  EXPECT_EQ(second.next_ack().status().code(), static_cast<std::uint32_t>(StatusCode::out_of_range));
  second.send(8, second.bent(0.2));
  EXPECT_EQ(second.next_ack().status().code(), 0U);
}

client::Access coming_back(const client::Client& client) {
  return {.authorities = {}, .token = {}, .resume_token = client.server().resume_token()};
}

TEST(Resume, SessionSubscriptionsAndControlComeBack) {
  const TestServer server;
  auto before = std::make_unique<TestClient>(server);  // an unnamed session: nobody else could find it
  const std::uint32_t mesh = before->subscribe_mesh();
  const std::uint32_t volume = before->subscribe_volume(before->opened().volumes(0).name());
  before->send(5, before->bent(0.4));
  const wire::Frame shown = before->next_mesh(5);
  const client::Access access = coming_back(before->client());
  const std::string session = before->opened().session();
  before.reset();

  client::Client after(server.address(), "test", access);
  ASSERT_TRUE(after.server().has_resumed());
  const v1::Resumed& resumed = after.server().resumed();
  EXPECT_EQ(resumed.session(), session);
  EXPECT_EQ(resumed.model(), "toy");
  EXPECT_EQ(resumed.role(), v1::ROLE_CONTROLLER);
  EXPECT_EQ(resumed.last_sequence(), 5U);
  ASSERT_EQ(resumed.subscriptions_size(), 2);
  EXPECT_EQ(resumed.subscriptions(0).was(), mesh);
  EXPECT_EQ(resumed.subscriptions(0).is(), mesh);
  EXPECT_EQ(resumed.subscriptions(1).was(), volume);
  // The pose that was shown comes first.
  const auto until = client::Clock::now() + std::chrono::seconds(10);
  while (const auto frame = after.receive(until)) {
    if (!frame->envelope.has_mesh_frame()) continue;
    EXPECT_EQ(frame->envelope.mesh_frame().pose_sequence(), 5U);
    EXPECT_EQ(frame->payload, shown.payload);
    break;
  }
  // Once only.
  const client::Client again(server.address(), "test", access);
  EXPECT_FALSE(again.server().has_resumed());
}

TEST(Resume, TakesAPlaceFromAConnectionThatHangs) {
  const TestServer server;
  TestClient hanging(server, "shared");
  hanging.subscribe_mesh();
  const client::Client after(server.address(), "test", coming_back(hanging.client()));
  EXPECT_EQ(after.server().resumed().role(), v1::ROLE_CONTROLLER);
  EXPECT_THROW(hanging.next([](const v1::Envelope&) { return false; }), Error);
}

TEST(Resume, NothingComesBackAfterAGoodbyeALongTimeOrWithAGuess) {
  Limits limits;
  limits.linger_seconds = 0.2;
  limits.sessions = 1;
  const TestServer server(limits);
  const auto resumed = [&](const client::Access& access) {
    return client::Client(server.address(), "test", access).server().has_resumed();
  };
  client::Access access;
  {
    TestClient polite(server);
    access = coming_back(polite.client());
    v1::Envelope goodbye;
    goodbye.mutable_goodbye();
    polite.client().send(goodbye);
    EXPECT_THROW(polite.next([](const v1::Envelope&) { return false; }), Error);
  }
  EXPECT_FALSE(resumed(access));
  {
    const TestClient slow(server);  // there is room: who only might come back makes way
    access.resume_token = "0123456789abcdef";
    EXPECT_FALSE(resumed(access));
  }
  {
    TestClient slow(server);
    access = coming_back(slow.client());
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  EXPECT_FALSE(resumed(access));
}

TEST(Ik, IsSolvedAsOfflineAndMayBeShown) {
  const TestServer server;
  TestClient client(server);
  client.subscribe_mesh();
  v1::Envelope request;
  v1::SolveIk& solve = *request.mutable_solve_ik();
  v1::IkTarget& target = *solve.add_targets();
  target.set_segment(2);
  target.mutable_rest_point()->set_z(100);
  target.mutable_target()->set_y(30);
  target.mutable_target()->set_z(90);
  const v1::IkSolved solved = client.client().call(request).envelope.ik_solved();

  kinematics::IkProblem problem;
  problem.targets.push_back({.segment = 2, .point = {0, 0, 100}, .goal = {0, 30, 90}, .weight = 1});
  const std::size_t joints = server.model().segment_count();
  const kinematics::IkResult offline = kinematics::solve_ik(server.model().rig, Pose::rest(joints), problem);
  v1::PoseUpdate expected;
  wire::to_proto(offline.pose, expected);
  ASSERT_EQ(solved.rotation_size(), expected.rotation_size());
  for (int i = 0; i < expected.rotation_size(); ++i) EXPECT_EQ(solved.rotation(i), expected.rotation(i));
  ASSERT_EQ(solved.residual_size(), 1);
  EXPECT_EQ(solved.residual(0), offline.away_mm[0]);

  solve.set_apply_as(3);
  client.client().call(request);
  client.next_mesh(3);
  const auto fails = [&](const auto& spoil) {
    v1::Envelope wrong = request;
    wrong.mutable_solve_ik()->set_apply_as(0);
    spoil(*wrong.mutable_solve_ik());
    return error_of_call(client.client(), wrong);
  };
  EXPECT_EQ(fails([](v1::SolveIk& s) { s.set_apply_as(3); }), ErrorKind::protocol);  // the sequence must grow
  EXPECT_EQ(fails([](v1::SolveIk& s) { s.clear_targets(); }), ErrorKind::protocol);
  EXPECT_EQ(fails([](v1::SolveIk& s) { s.mutable_targets(0)->set_segment(99); }), ErrorKind::protocol);
  EXPECT_EQ(fails([](v1::SolveIk& s) { s.mutable_targets(0)->mutable_target()->set_x(NAN); }),
            ErrorKind::protocol);
  EXPECT_EQ(fails([](v1::SolveIk& s) { s.mutable_targets(0)->set_weight(-1); }), ErrorKind::protocol);
  EXPECT_EQ(fails([](v1::SolveIk& s) { s.add_rotation(1); }), ErrorKind::protocol);
  EXPECT_EQ(fails([](v1::SolveIk& s) {
              for (int i = 0; i < 65; ++i) *s.add_targets() = s.targets(0);
            }),
            ErrorKind::protocol);
}

// The mesh of the clip's last pose, which is the same as a client's.
wire::Payload last_of_turning(const TestServer& server) {
  TestClient twin(server);
  twin.subscribe_mesh();
  twin.send(1, twin.bent(0.19));
  return twin.next_mesh(1).payload;
}

TEST(ClipTest, IsListedAndPlayedByTheServerAtItsRate) {
  const TestServer server;
  TestClient client(server, "shared"), observer(server, "shared");
  v1::Envelope list;
  list.mutable_list_clips();
  const v1::ClipList clips = client.client().call(list).envelope.clip_list();
  ASSERT_EQ(clips.clips_size(), 1);
  EXPECT_EQ(clips.clips(0).name(), "turning");
  EXPECT_NEAR(clips.clips(0).seconds(), 0.2, 1e-9);
  EXPECT_NEAR(clips.clips(0).frames_per_second(), 100, 1e-6);

  observer.subscribe_mesh();
  EXPECT_EQ(error_of_call(observer.client(), play("turning")), ErrorKind::refused);
  EXPECT_EQ(error_of_call(client.client(), play("running")), ErrorKind::usage);
  EXPECT_EQ(error_of_call(client.client(), play("turning", 1000)), ErrorKind::protocol);
  client.send(10, client.bent(0));
  client.next_ack();
  const wire::Payload last = last_of_turning(server);
  const auto start = client::Clock::now();
  client.client().call(play("turning", 0.25));
  std::uint64_t frames = 0;
  while (observer.next([](const v1::Envelope& e) { return e.has_mesh_frame(); }).payload != last) ++frames;
  EXPECT_GE(client::Clock::now() - start, std::chrono::milliseconds(740));  // 19 steps of 40 ms
  EXPECT_GT(frames, 3U);
  // The controller hears of the poses; its own go on from there.
  std::uint64_t sequence = 10;
  while (const auto ack = client.client().receive(client::Clock::now() + std::chrono::milliseconds(200)))
    sequence = std::max(sequence, ack->envelope.pose_ack().sequence());
  EXPECT_GT(sequence, 13U);
  client.send(10, client.bent(0));
  EXPECT_EQ(client.next_ack().status().code(), static_cast<std::uint32_t>(StatusCode::out_of_range))
      << "its own numbers grow";
}

TEST(ClipTest, APoseThatCrossesTheClipsOwnIsTheNextAfterThem) {
  const TestServer server;
  TestClient client(server);
  client.subscribe_mesh();
  const wire::Payload last = last_of_turning(server);
  client.client().call(play("turning", 0.25));
  std::uint64_t played = 0;
  for (bool ended = false; !ended;) {
    const wire::Frame frame = client.next([](const v1::Envelope& e) { return e.has_mesh_frame(); });
    played = frame.envelope.mesh_frame().pose_sequence();
    ended = frame.payload == last;
  }
  ASSERT_GE(played, 2U);
  // As if none of that had come yet.
  for (const std::uint64_t sent : {1, 2}) {
    client.send(sent, client.bent(0.1 * static_cast<double>(sent)));
    const v1::PoseAck ack = client.next_ack();
    EXPECT_EQ(ack.status().code(), 0U);
    EXPECT_EQ(ack.sequence(), played + sent);
    EXPECT_EQ(client.next_mesh(played + sent).envelope.mesh_frame().pose_sequence(), played + sent);
  }
  client.send(played + 3, client.bent(0));
  EXPECT_EQ(client.next_ack().sequence(), played + 3);
}

TEST(ClipTest, ALoopGoesOnUntilAPoseOrAStopEndsIt) {
  const TestServer server;
  TestClient client(server);
  for (const bool by_pose : {true, false}) {
    client.client().call(play("turning", 5, true));
    std::uint64_t sequence = 0;
    for (int i = 0; i < 30; ++i) sequence = client.next_ack().sequence();  // 40 ms a lap
    if (by_pose)
      client.send(sequence + 1000, client.bent(0.3));
    else
      client.client().call(play(""));
    while (const auto ack = client.client().receive(client::Clock::now() + std::chrono::milliseconds(150)))
      sequence = std::max(sequence, ack->envelope.pose_ack().sequence());
    // Silence: nothing plays any more.
    EXPECT_FALSE(client.client().receive(client::Clock::now() + std::chrono::milliseconds(50)));
  }
}

TEST(Thresholds, DecideTheVerdict) {
  const TestServer server;
  TestClient client(server);
  client.subscribe_mesh({}, true);
  client.send(1, client.bent(0.5));
  const v1::PoseQuality before = client.next_mesh(1).envelope.mesh_frame().quality();
  v1::Envelope strict;
  strict.mutable_set_thresholds()->set_max_volume_change(std::abs(before.volume_change()) / 2);
  client.client().call(strict);
  const auto judged_again = [](const v1::Envelope& e) {
    return e.has_mesh_frame() && e.mesh_frame().quality().max_volume_change() < 0.1;
  };
  EXPECT_EQ(client.next(judged_again).envelope.mesh_frame().quality().verdict(),
            v1::PoseQuality::VERDICT_WARN);
  for (const double wrong : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    strict.mutable_set_thresholds()->set_max_inverted_share(wrong);
    EXPECT_EQ(error_of_call(client.client(), strict), ErrorKind::protocol);
  }
}

}  // namespace
}  // namespace ecorche::server
