// SPDX-License-Identifier: Apache-2.0
// What a session showed, recorded, read back and played.
#include "proto/recording.hpp"

#include <filesystem>
#include <fstream>

#include <ecorche/wire/convert.hpp>
#include "runtime/server/net/tls.hpp"
#include "runtime/server/session/recording.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

class RecordingTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("ecorche_record_" + random_token());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Options options() const {
    Options options;
    options.record_folder = folder_;
    return options;
  }
  std::string bytes(const std::string& name) const {
    std::ifstream file(folder_ / (name + ".ecrec"), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::filesystem::path folder_;
};

Status read(const std::string& bytes, wire::RecordedSession& out) {
  return wire::read_recording(std::as_bytes(std::span(bytes)), out);
}

TEST_F(RecordingTest, HoldsThePosesAndWhatTheirFramesWere) {
  const TestServer server(options());
  TestClient client(server);
  const std::uint32_t shown = client.subscribe_mesh({"skin"});
  // What follows from the frames before cannot be played again: it is left out.
  v1::Envelope delta, adaptive, bricks;
  delta.mutable_subscribe()->mutable_mesh()->set_encoding(v1::ENCODING_U16_DELTA);
  adaptive.mutable_subscribe()->mutable_mesh()->set_adaptive(true);
  bricks.mutable_subscribe()->mutable_volume()->set_volume("ct");
  bricks.mutable_subscribe()->mutable_volume()->set_changed_bricks(true);
  for (const v1::Envelope& other : {delta, adaptive, bricks}) {
    const v1::Envelope answer = client.client().call(other).envelope;
    EXPECT_TRUE(answer.has_subscribed()) << answer.status().message();
  }
  const auto next_shown = [&](std::uint64_t sequence) {
    return client.next([&](const v1::Envelope& e) {
      return e.has_mesh_frame() && e.mesh_frame().subscription() == shown &&
             e.mesh_frame().pose_sequence() == sequence;
    });
  };
  client.send(1, client.bent(0.1));
  next_shown(1);
  client.client().call(record(true, "bow"));
  std::vector<std::uint64_t> digests;
  for (std::uint64_t sequence = 2; sequence <= 5; ++sequence) {
    client.send(sequence, client.bent(0.1 * static_cast<double>(sequence)));
    digests.push_back(wire::payload_digest(next_shown(sequence).payload));
  }
  client.client().call(record(false));

  wire::RecordedSession session;
  const Status status = read(bytes("bow"), session);
  ASSERT_TRUE(status.ok()) << status.message;
  EXPECT_EQ(session.head.model(), "toy");
  EXPECT_EQ(session.head.identity(), client.opened().identity());
  ASSERT_EQ(session.subscriptions.size(), 1U);
  EXPECT_EQ(session.subscriptions.begin()->second.mesh().tissues(0), "skin");
  ASSERT_EQ(session.steps.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    const wire::RecordedStep& step = session.steps[i];
    EXPECT_EQ(step.pose.sequence(), i + 2);
    Pose pose;
    ASSERT_TRUE(wire::from_proto(step.pose, server.model().segment_count(), pose).ok());
    EXPECT_EQ(pose.rotation[2].coeffs(), client.bent(0.1 * static_cast<double>(i + 2)).rotation[2].coeffs());
    ASSERT_EQ(step.frames.size(), 1U);
    EXPECT_EQ(step.frames[0].digest(), digests[i]);
  }
  // It is a clip from now on.
  v1::Envelope list;
  list.mutable_list_clips();
  const v1::ClipList clips = client.client().call(list).envelope.clip_list();
  ASSERT_EQ(clips.clips_size(), 2);
  EXPECT_EQ(clips.clips(1).name(), "bow");
  v1::Envelope play;
  play.mutable_play_clip()->set_name("bow");
  client.client().call(play);
  while (
      wire::payload_digest(client.next([](const v1::Envelope& e) { return e.has_mesh_frame(); }).payload) !=
      digests.back()) {
  }
}

TEST_F(RecordingTest, OneThatNobodyEndsIsKeptWhenItsSessionEnds) {
  Options some = options();
  some.limits.linger_seconds = 0.1;
  TestServer server(some);
  std::uint64_t digest = 0;  // of the one subscription's frame, which is sent as it was posed
  const auto show_one = [&](TestClient& client, const std::string& name) {
    client.subscribe_mesh({"skin"});
    client.client().call(record(true, name));
    client.send(1, client.bent(0.3));
    digest = wire::payload_digest(client.next_mesh(1).payload);
  };
  const auto record_one = [&](const std::string& name, const std::string& session) {
    TestClient client(server, session);
    show_one(client, name);
  };
  const auto whole = [&](const std::string& name) {
    wire::RecordedSession session;
    return !bytes(name).empty() && read(bytes(name), session).ok() && session.steps.size() == 1 &&
           session.steps[0].frames.size() == 1 && session.steps[0].frames[0].digest() == digest;
  };
  record_one("left", "");
  record_one("left_named", "room");
  for (int i = 0; i < 500 && !(whole("left") && whole("left_named")); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_TRUE(whole("left"));
  EXPECT_TRUE(whole("left_named"));
  TestClient stays(server);
  show_one(stays, "stopped");
  server.stop();
  server.join();
  EXPECT_TRUE(whole("stopped"));
}

TEST_F(RecordingTest, NamesFoldersAndOrderAreChecked) {
  const TestServer server(options()), keeps_none;
  TestClient client(server), other(keeps_none);
  EXPECT_EQ(error_of_call(other.client(), record(true, "bow")), ErrorKind::protocol);
  EXPECT_EQ(error_of_call(client.client(), record(false)), ErrorKind::protocol);
  for (const char* name : {"", "../bow", "Bow", "a b"})
    EXPECT_EQ(error_of_call(client.client(), record(true, name)), ErrorKind::protocol) << name;
  client.client().call(record(true, "bow"));
  EXPECT_EQ(error_of_call(client.client(), record(true, "nod")), ErrorKind::protocol);
  client.send(1, client.bent(0.1));
  client.next_ack();
  client.client().call(record(false));
  EXPECT_EQ(error_of_call(client.client(), record(true, "bow")), ErrorKind::protocol);  // there is one
  wire::RecordedSession session;
  EXPECT_TRUE(read(bytes("bow"), session).ok());
  EXPECT_EQ(session.steps.size(), 1U);
}

TEST_F(RecordingTest, FourAtOnceAndAFolderThatIsNotFull) {
  Options all = options();
  all.limits.peer_share = 1;
  all.limits.recordings_per_minute = 1e6;
  const TestServer server(all);
  std::vector<std::unique_ptr<TestClient>> clients;
  for (int i = 0; i < 5; ++i) {
    clients.push_back(std::make_unique<TestClient>(server));
    if (i < 4) clients.back()->client().call(record(true, "take_" + std::to_string(i)));
  }
  EXPECT_EQ(error_of_call(clients[4]->client(), record(true, "take_4")), ErrorKind::temporary);
  clients[0]->send(1, clients[0]->bent(0.1));
  clients[0]->next_ack();
  clients[0]->client().call(record(false));
  for (int i = 0; i < 255; ++i) std::ofstream(folder_ / std::to_string(i)) << i;
  EXPECT_EQ(error_of_call(clients[4]->client(), record(true, "take_4")), ErrorKind::temporary);
  std::filesystem::remove(folder_ / "0");
  clients[4]->client().call(record(true, "take_4"));
}

TEST_F(RecordingTest, EndsAtItsLimitAndIsWholeUpToThere) {
  Options small = options();
  small.limits.record_bytes = 2048;
  const TestServer server(small);
  TestClient client(server);
  client.client().call(record(true, "bow"));
  for (std::uint64_t sequence = 1; sequence <= 30; ++sequence) {
    client.send(sequence, client.bent(0.01));
    client.next_ack();
  }
  EXPECT_EQ(error_of_call(client.client(), record(false)), ErrorKind::temporary);
  wire::RecordedSession session;
  ASSERT_TRUE(read(bytes("bow"), session).ok());
  EXPECT_TRUE(session.full);
  EXPECT_GT(session.steps.size(), 2U);
  EXPECT_LT(session.steps.size(), 30U);
  EXPECT_LE(bytes("bow").size(), 2048U);
}

// Wherever the limit cuts: the end, which says how much there is, has its place.
TEST_F(RecordingTest, NeverGrowsBeyondItsLimit) {
  const ServedModel model("toy", std::make_shared<const Model>(test::toy_model()));
  PoseRequest pose;
  pose.pose = Pose::rest(model.model().segment_count());
  for (std::size_t limit = 2048; limit < 2048 + 512; limit += 16) {
    Recording recording("bow", model, "test", limit);
    for (pose.sequence = 1; !recording.full(); ++pose.sequence) recording.add(pose);
    recording.finish();
    const std::string name = "bow_" + std::to_string(limit);
    RecordingFile file(folder_ / (name + ".ecrec"));
    file.append(recording.take());
    ASSERT_TRUE(file.commit().ok());
    wire::RecordedSession session;
    EXPECT_TRUE(read(bytes(name), session).ok());
    EXPECT_LE(bytes(name).size(), limit);
  }
}

// Who takes over a session that nobody controls begins at 1, as far as it knows.
TEST_F(RecordingTest, GoesOnWhereAnotherControllerCountsAnew) {
  const TestServer server(options());
  auto first = std::make_unique<TestClient>(server, "shared");
  first->client().call(record(true, "hands"));
  first->send(7, first->bent(0.1));
  first->next_ack();
  v1::Envelope release;
  release.mutable_release_control();
  first->client().call(release);
  TestClient second(server, "shared");
  second.subscribe_mesh({"skin"});
  second.send(1, second.bent(0.2));
  const std::uint64_t digest = wire::payload_digest(second.next_mesh(1).payload);
  second.client().call(record(false));
  wire::RecordedSession session;
  const Status status = read(bytes("hands"), session);
  ASSERT_TRUE(status.ok()) << status.message;
  ASSERT_EQ(session.steps.size(), 2U);
  EXPECT_EQ(session.steps[0].pose.sequence(), 7U);
  EXPECT_EQ(session.steps[1].pose.sequence(), 8U);
  ASSERT_EQ(session.steps[1].frames.size(), 1U);
  EXPECT_EQ(session.steps[1].frames[0].digest(), digest);
}

// Or the second could not be ended: there is a file of its name by then.
TEST_F(RecordingTest, TwoOfOneNameDoNotRunAtOnce) {
  const TestServer server(options());
  TestClient first(server), second(server);
  first.client().call(record(true, "bow"));
  try {
    second.client().call(record(true, "bow"));
    ADD_FAILURE() << "it runs";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("another session's recording 'bow' runs"), std::string::npos)
        << error.what();
  }
  second.client().call(record(true, "nod"));
  for (TestClient* client : {&first, &second}) {
    client->send(1, client->bent(0.1));
    client->next_ack();
    client->client().call(record(false));
  }
}

std::string file_of(const std::vector<v1::Envelope>& envelopes) {
  std::string out;
  for (const v1::Envelope& envelope : envelopes) out += wire::encode(envelope).head;
  return out;
}

std::vector<v1::Envelope> good_recording() {
  std::vector<v1::Envelope> all(5);
  all[0].mutable_recording_head()->set_version(1);
  all[1].mutable_recorded_subscription()->set_subscription(3);
  all[2].mutable_recorded_pose()->mutable_pose()->set_sequence(7);
  all[3].mutable_recorded_frame()->set_subscription(3);
  all[3].mutable_recorded_frame()->set_pose_sequence(7);
  all[4].mutable_recording_end()->set_poses(1);
  all[4].mutable_recording_end()->set_frames(1);
  return all;
}

TEST(RecordingFile, EveryPrefixAndEveryBrokenRuleIsRefused) {
  wire::RecordedSession session;
  const std::string good = file_of(good_recording());
  ASSERT_TRUE(read(good, session).ok());
  for (std::size_t length = 0; length < good.size(); ++length) {
    EXPECT_EQ(read(good.substr(0, length), session).code, StatusCode::data_loss) << length;
  }
  const auto broken = [&](const auto& spoil) {
    std::vector<v1::Envelope> all = good_recording();
    spoil(all);
    return read(file_of(all), session).code;
  };
  using All = std::vector<v1::Envelope>;
  const auto invalid = StatusCode::invalid_argument;
  EXPECT_EQ(broken([](All& a) { a[0].mutable_recording_head()->set_version(2); }), StatusCode::unimplemented);
  EXPECT_EQ(broken([](All& a) { std::swap(a[0], a[1]); }), invalid);
  EXPECT_EQ(broken([](All& a) { a.insert(a.begin(), a[0]); }), invalid);
  EXPECT_EQ(broken([](All& a) { a.insert(a.begin() + 1, a[1]); }), invalid);
  EXPECT_EQ(broken([](All& a) { a.insert(a.begin() + 2, a[2]); }), invalid);
  EXPECT_EQ(broken([](All& a) { a[2].mutable_recorded_pose()->set_seconds(-1); }), invalid);
  EXPECT_EQ(broken([](All& a) { a[3].mutable_recorded_frame()->set_subscription(4); }), invalid);
  EXPECT_EQ(broken([](All& a) { a[3].mutable_recorded_frame()->set_pose_sequence(8); }), invalid);
  EXPECT_EQ(broken([](All& a) { a[4].mutable_recording_end()->set_frames(2); }), invalid);
  EXPECT_EQ(broken([](All& a) { a.push_back(a[4]); }), invalid);
  EXPECT_EQ(broken([](All& a) { a[3].mutable_ping(); }), invalid);
}

TEST(RecordingFile, AnyByteMayBeAnyOther) {
  wire::RecordedSession session;
  const std::string good = file_of(good_recording());
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const int flip : {1, 0x80, 0xff}) {
      std::string bytes = good;
      bytes[i] = static_cast<char>(bytes[i] ^ flip);
      read(bytes, session);  // whatever it says, it says it
    }
  }
}

}  // namespace
}  // namespace ecorche::server
