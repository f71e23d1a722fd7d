// SPDX-License-Identifier: Apache-2.0
// Several in one session: who is there, who has control and gives it, from which pose they go on, and how far
// a clip is. Over real sockets.
#include <ecorche/wire/convert.hpp>
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

// A client that hears of clips and members, by its messages alone.
class Guest {
 public:
  Guest(const TestServer& server, const std::string& name, bool hears = true) : client_(server) {
    v1::Envelope hello = greeting();
    hello.mutable_client_hello()->set_client("unit test");
    hello.mutable_client_hello()->set_name(name);
    if (hears) {
      hello.mutable_client_hello()->add_features(v1::FEATURE_PRESENCE);
      hello.mutable_client_hello()->add_features(v1::FEATURE_CLIP_STATE);
    }
    hello_ = call(hello).server_hello();
    v1::Envelope open;
    open.mutable_open_model()->set_model("toy");
    open.mutable_open_model()->set_session("shared");
    opened_ = call(open).model_opened();
  }

  std::uint64_t number() const { return hello_.connection(); }
  const v1::ServerHello& hello() const { return hello_; }
  const v1::ModelOpened& opened() const { return opened_; }

  v1::Envelope call(v1::Envelope request) {
    request.set_request_id(++requests_);
    client_.send(request);
    return next([&](const v1::Envelope& e) { return e.request_id() == requests_; });
  }
  StatusCode code_of(const v1::Envelope& request) { return wire::from_proto(call(request).status()).code; }
  // The next message for which `wanted` holds, of those that came before, too.
  template <class Wanted>
  v1::Envelope next(Wanted&& wanted, double seconds = 10) {
    for (auto it = heard_.begin(); it != heard_.end(); ++it) {
      if (!wanted(*it)) continue;
      v1::Envelope found = std::move(*it);
      heard_.erase(it);
      return found;
    }
    while (auto frame = client_.receive(seconds)) {
      if (frame->envelope.has_mesh_frame()) acknowledge(frame->envelope.mesh_frame());
      if (wanted(frame->envelope)) return std::move(frame->envelope);
      heard_.push_back(std::move(frame->envelope));
    }
    ADD_FAILURE() << "the message did not come";
    return {};
  }
  // Whether it is told such a thing within the time.
  template <class Wanted>
  bool hears(Wanted&& wanted, double seconds) {
    while (auto frame = client_.receive(seconds)) heard_.push_back(std::move(frame->envelope));
    return std::any_of(heard_.begin(), heard_.end(), wanted);
  }
  // As it is told that they are; `wanted` decides which list.
  template <class Wanted>
  std::string members(Wanted&& wanted) {
    const auto listed = [](const v1::Members& list) {
      std::string out;
      for (const v1::SessionMember& member : list.members())
        out += member.name() + (member.role() == v1::ROLE_CONTROLLER ? "!" : "") +
               (member.asks_control() ? "?" : "") + " ";
      return out;
    };
    const v1::Envelope found =
        next([&](const v1::Envelope& e) { return e.has_members() && wanted(listed(e.members())); });
    return listed(found.members());
  }
  bool sees(const std::string& members) {
    return this->members([&](const std::string& listed) { return listed == members; }) == members;
  }
  v1::ClipState clip(const std::function<bool(const v1::ClipState&)>& wanted) {
    return next([&](const v1::Envelope& e) { return e.has_clip_state() && wanted(e.clip_state()); })
        .clip_state();
  }
  void pose(std::uint64_t sequence, double angle) {
    v1::Envelope envelope;
    v1::PoseUpdate& update = *envelope.mutable_pose_update();
    update.set_sequence(sequence);
    update.set_rig_digest(opened_.rig_digest());
    Pose pose = Pose::rest(static_cast<std::size_t>(opened_.skeleton().segments_size()));
    pose.rotation[2] = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX());
    pose.root_translation.x() = 7;
    wire::to_proto(pose, update);
    client_.send(envelope);
  }
  StatusCode ack(std::uint64_t sequence) {
    const v1::Envelope found =
        next([&](const v1::Envelope& e) { return e.has_pose_ack() && e.pose_ack().sequence() == sequence; });
    return wire::from_proto(found.pose_ack().status()).code;
  }
  void goodbye() {
    v1::Envelope envelope;
    envelope.mutable_goodbye();
    client_.send(envelope);
  }

 private:
  void acknowledge(const v1::MeshFrame& frame) {
    v1::Envelope envelope;
    envelope.mutable_frame_ack()->set_subscription(frame.subscription());
    envelope.mutable_frame_ack()->set_frame(frame.frame());
    client_.send(envelope);
  }

  RawClient client_;
  v1::ServerHello hello_;
  v1::ModelOpened opened_;
  std::vector<v1::Envelope> heard_;
  std::uint64_t requests_ = 0;
};

v1::Envelope ask(bool withdraw = false) {
  v1::Envelope envelope;
  envelope.mutable_ask_control()->set_withdraw(withdraw);
  return envelope;
}

v1::Envelope give(std::uint64_t connection) {
  v1::Envelope envelope;
  envelope.mutable_give_control()->set_connection(connection);
  return envelope;
}

v1::Envelope play(const std::string& name, double speed = 1, bool loop = true, double position = 0,
                  bool paused = false) {
  v1::Envelope envelope;
  v1::PlayClip& clip = *envelope.mutable_play_clip();
  clip.set_name(name);
  clip.set_speed(speed);
  clip.set_loop(loop);
  clip.set_position(position);
  clip.set_paused(paused);
  return envelope;
}

bool is_news(const v1::Envelope& e) {
  return e.has_members() || e.has_clip_state();
}

TEST(Together, EachSeesWhoIsThereAsTheyComeAndGo) {
  const TestServer server;
  Guest ada(server, "Ada");
  EXPECT_TRUE(ada.sees("Ada! "));
  {
    Guest bo(server, "Bo\u202e\n");
    EXPECT_TRUE(bo.sees("Ada! Bo "));
    EXPECT_TRUE(ada.sees("Ada! Bo "));
    bo.goodbye();
  }
  EXPECT_TRUE(ada.sees("Ada! "));
  const Guest nameless(server, "");
  EXPECT_TRUE(ada.sees("Ada! unit test "));
}

TEST(Together, ControlIsAskedForAndGiven) {
  const TestServer server;
  Guest ada(server, "Ada"), bo(server, "Bo");
  ada.pose(5, 0.3);
  EXPECT_EQ(ada.ack(5), StatusCode::ok);
  EXPECT_EQ(bo.code_of(ask()), StatusCode::ok) << "Ada holds it";
  EXPECT_TRUE(ada.sees("Ada! Bo? "));
  EXPECT_EQ(bo.code_of(ask(true)), StatusCode::ok);
  EXPECT_TRUE(ada.sees("Ada! Bo "));
  EXPECT_EQ(bo.code_of(give(ada.number())), StatusCode::permission_denied);
  EXPECT_EQ(ada.code_of(give(12345)), StatusCode::not_found);
  EXPECT_EQ(ada.code_of(give(ada.number())), StatusCode::ok) << "she has it";
  EXPECT_EQ(bo.code_of(ask()), StatusCode::ok);
  EXPECT_EQ(ada.code_of(give(bo.number())), StatusCode::ok);
  const v1::Envelope granted = bo.next([](const v1::Envelope& e) { return e.has_control_granted(); });
  EXPECT_EQ(granted.request_id(), 0U);
  EXPECT_EQ(granted.control_granted().last_sequence(), 5U);
  EXPECT_EQ(granted.control_granted().pose().sequence(), 5U);
  EXPECT_EQ(granted.control_granted().pose().root_translation().x(), 7);
  EXPECT_TRUE(ada.sees("Bo! Ada "));
  ada.pose(6, 0.1);
  EXPECT_EQ(ada.ack(6), StatusCode::permission_denied);
  bo.pose(6, 0.2);
  EXPECT_EQ(bo.ack(6), StatusCode::ok);
  // Free control is granted to who asks.
  v1::Envelope release;
  release.mutable_release_control();
  EXPECT_EQ(bo.code_of(release), StatusCode::ok);
  EXPECT_EQ(ada.call(ask()).control_granted().last_sequence(), 6U);
}

// Who knows nothing of it is told nothing new, and gets no control that it does not know of.
TEST(Together, OldClientsSeeNothingNew) {
  const TestServer server;
  Guest ada(server, "Ada"), old(server, "", false);
  EXPECT_TRUE(ada.sees("Ada! unit test "));
  EXPECT_EQ(ada.code_of(give(old.number())), StatusCode::failed_precondition);
  EXPECT_EQ(old.code_of(ask()), StatusCode::failed_precondition);
  EXPECT_EQ(ada.call(play("turning")).status().code(), 0U);
  EXPECT_FALSE(old.hears(is_news, 0.6));
}

TEST(Together, WhoComesStartsFromThePresentPose) {
  const TestServer server;
  Guest ada(server, "Ada");
  EXPECT_EQ(ada.opened().pose().sequence(), 0U);
  EXPECT_EQ(ada.opened().pose().rotation_size(), 4 * ada.opened().skeleton().segments_size());
  ada.pose(3'000'000, 0.3);
  EXPECT_EQ(ada.ack(3'000'000), StatusCode::ok);
  const std::uint64_t far = 19'000'000;  // by less than 2^24
  ada.pose(far, 0.4);
  EXPECT_EQ(ada.ack(far), StatusCode::ok);
  Guest bo(server, "Bo");
  EXPECT_EQ(bo.opened().last_sequence(), far);
  EXPECT_EQ(bo.opened().pose().sequence(), far);
  EXPECT_EQ(bo.opened().pose().skinning(), v1::SKINNING_COR);
  EXPECT_EQ(bo.opened().pose().rotation(8), std::cos(0.2)) << "exactly as it was sent";
  // Who opens a session that its controller left goes on from there.
  ada.goodbye();
  EXPECT_TRUE(bo.sees("Bo "));
  Guest cy(server, "Cy");
  EXPECT_EQ(cy.opened().role(), v1::ROLE_CONTROLLER);
  EXPECT_EQ(cy.opened().last_sequence(), far);
  cy.pose(far + (1U << 24U) + 1, 0.1);
  EXPECT_EQ(cy.ack(far + (1U << 24U) + 1), StatusCode::out_of_range);
  cy.pose(far + 1, 0.1);
  EXPECT_EQ(cy.ack(far + 1), StatusCode::ok);
}

TEST(Together, ObserversGetThePoseWithTheFrame) {
  const TestServer server;
  Guest ada(server, "Ada"), bo(server, "Bo");
  v1::Envelope subscribe;
  subscribe.mutable_subscribe()->mutable_mesh()->set_pose(true);
  const std::uint32_t with = bo.call(subscribe).subscribed().subscription();
  subscribe.mutable_subscribe()->mutable_mesh()->set_pose(false);
  const std::uint32_t without = bo.call(subscribe).subscribed().subscription();
  EXPECT_NE(with, without);
  ada.pose(4, 0.6);
  const auto frame_of = [&](std::uint32_t subscription) {
    return bo
        .next([&](const v1::Envelope& e) {
          return e.mesh_frame().subscription() == subscription && e.mesh_frame().pose_sequence() == 4;
        })
        .mesh_frame();
  };
  const v1::PoseState pose = frame_of(with).pose();
  EXPECT_EQ(pose.sequence(), 4U);
  EXPECT_EQ(pose.rotation(8), std::cos(0.3));
  EXPECT_EQ(pose.root_translation().x(), 7);
  EXPECT_FALSE(frame_of(without).has_pose());
}

TEST(Together, AClipIsSteeredAndAllSeeWhereItIs) {
  const TestServer server;
  Guest ada(server, "Ada"), bo(server, "Bo");
  v1::Envelope steer;
  steer.mutable_steer_clip()->set_paused(true);
  EXPECT_EQ(ada.code_of(steer), StatusCode::failed_precondition) << "nothing plays";
  EXPECT_EQ(bo.code_of(steer), StatusCode::permission_denied);
  EXPECT_EQ(ada.code_of(play("turning", 0.5, true, 0.1, true)), StatusCode::ok);
  v1::ClipState state = bo.clip([](const v1::ClipState& s) { return s.name() == "turning"; });
  EXPECT_EQ(state.position(), 0.1);
  EXPECT_NEAR(state.seconds(), 0.2, 1e-9);
  EXPECT_NEAR(state.frames_per_second(), 100, 1e-6);
  EXPECT_EQ(state.speed(), 0.5);
  EXPECT_TRUE(state.loop());
  EXPECT_FALSE(state.playing());

  steer.mutable_steer_clip()->set_paused(false);
  EXPECT_EQ(ada.code_of(steer), StatusCode::ok);
  bo.clip([](const v1::ClipState& s) { return s.playing(); });
  // While it plays, some are told each second.
  bo.clip([](const v1::ClipState& s) { return s.playing(); });
  const Guest late(server, "Cy");
  Guest latest(server, "Di");
  latest.clip([](const v1::ClipState& s) { return s.name() == "turning"; });

  steer.mutable_steer_clip()->set_position(0.05);
  steer.mutable_steer_clip()->set_step(2);
  EXPECT_EQ(ada.code_of(steer), StatusCode::ok);
  state = bo.clip([](const v1::ClipState& s) { return !s.playing(); });
  EXPECT_NEAR(state.position(), 0.07, 1e-9);
  for (const double wrong :
       {-0.1, 0.3, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    steer.mutable_steer_clip()->set_position(wrong);
    EXPECT_EQ(ada.code_of(steer), StatusCode::out_of_range) << wrong;
    EXPECT_EQ(ada.code_of(play("turning", 1, true, wrong)), StatusCode::out_of_range) << wrong;
  }
  steer.mutable_steer_clip()->set_position(0);
  steer.mutable_steer_clip()->set_speed(1000);
  EXPECT_EQ(ada.code_of(steer), StatusCode::invalid_argument);
  // A pose of the controller ends it, and all are told.
  ada.pose(1'000'000, 0.1);
  bo.clip([](const v1::ClipState& s) { return s.name().empty(); });
  steer.mutable_steer_clip()->set_speed(1);
  EXPECT_EQ(ada.code_of(steer), StatusCode::failed_precondition);
}

// However fast one asks, the others are told four times a second.
TEST(Together, NobodyIsFloodedByWhoAsksAndWithdraws) {
  const TestServer server;
  Guest ada(server, "Ada"), bo(server, "Bo");
  const auto begin = client::Clock::now();
  for (int i = 0; i < 200; ++i) bo.code_of(ask(i % 2 == 1));
  int told = 0;
  ada.hears([&](const v1::Envelope& e) { return told += e.has_members() ? 1 : 0, false; }, 0.5);
  const double seconds = std::chrono::duration<double>(client::Clock::now() - begin).count();
  EXPECT_LE(told, 4 * seconds + 3);
}

}  // namespace
}  // namespace ecorche::server
