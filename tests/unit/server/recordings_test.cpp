// SPDX-License-Identifier: Apache-2.0
// Who may record, how it reaches the disk, and what is left of those who go.
#include "runtime/server/registry/recordings.hpp"

#include <filesystem>
#include <fstream>

#include "proto/recording.hpp"
#include "runtime/server/net/tls.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

namespace fs = std::filesystem;

class RecordingsTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("ecorche_records_" + random_token());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Options options() const {
    Options options;
    options.record_folder = folder_;
    options.limits.recordings_per_minute = 1e12;  // two turns of a loopback can be shorter than 60 us
    return options;
  }
  std::ptrdiff_t files() const {
    const fs::directory_iterator at(folder_);
    return std::distance(begin(at), end(at));
  }
  Status read(const std::string& name, wire::RecordedSession& out) const {
    std::ifstream file(folder_ / name, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    return wire::read_recording(std::as_bytes(std::span(bytes)), out);
  }

  fs::path folder_;
};

// Why it is refused; empty where it is not.
std::string refusal(TestClient& client, const v1::Envelope& request) {
  try {
    client.client().call(request);
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

template <class Done>
bool within_seconds(double most, Done&& done) {
  const auto until = Clock::now() + duration(most);
  while (Clock::now() < until) {
    if (done()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return done();
}

TEST_F(RecordingsTest, WithoutAPoseThereIsNoFile) {
  const TestServer server(options());
  TestClient client(server);
  for (int i = 0; i < 300; ++i) {
    ASSERT_EQ(refusal(client, record(true, "take_" + std::to_string(i))), "") << i;
    ASSERT_TRUE(says(refusal(client, record(false)), "no pose came while it ran")) << i;
  }
  EXPECT_EQ(files(), 0);
}

TEST_F(RecordingsTest, OneAddressHasItsShare) {
  Options options = this->options();
  options.limits.recording_files = 8;
  const TestServer server(options);
  std::vector<std::unique_ptr<TestClient>> clients;
  for (int i = 0; i < 4; ++i) {
    clients.push_back(std::make_unique<TestClient>(server));
    const std::string why = refusal(*clients.back(), record(true, "take_" + std::to_string(i)));
    EXPECT_EQ(says(why, "3 recordings of your address run already"), i == 3) << why;
  }
  // Of the folder, too: three run, and three more are six of eight.
  const auto take = [&](const std::string& name) {
    TestClient& client = *clients[0];
    client.client().call(record(false));
    return refusal(client, record(true, name));
  };
  std::uint64_t sequence = 0;
  for (int i = 0; i < 4; ++i) {
    clients[0]->send(++sequence, clients[0]->bent(0.1));
    clients[0]->next_ack();
    const std::string why = take("more_" + std::to_string(i));
    EXPECT_EQ(says(why, "your address' share of the server's folder is full"), i == 3) << why;
  }
}

TEST_F(RecordingsTest, AreNotBegunTooFast) {
  Options options = this->options();
  options.limits.recordings_per_minute = 6;
  const TestServer server(options);
  TestClient client(server);
  for (int i = 0; i < 5; ++i) {
    const std::string why = refusal(client, record(true, "take_" + std::to_string(i)));
    EXPECT_EQ(says(why, "your address begins them too fast"), i == 4) << why;
    refusal(client, record(false));
  }
}

// Long before its session ends, which it may come back to.
TEST_F(RecordingsTest, EndsSoonAfterItsClientHasGone) {
  const TestServer server(options());
  {
    TestClient client(server, "named");
    client.client().call(record(true, "left"));
    client.send(1, client.bent(0.1));
    client.next_ack();
  }
  wire::RecordedSession session;
  EXPECT_TRUE(within_seconds(20, [&] { return read("left.ecrec", session).ok(); }));
  EXPECT_EQ(session.steps.size(), 1U);
}

TEST_F(RecordingsTest, ReachesTheDiskWhileItRuns) {
  const TestServer server(options());
  TestClient client(server);
  client.subscribe_mesh({"skin"});
  client.client().call(record(true, "long"));
  wire::RecordedSession session;
  std::uint64_t sequence = 0;
  const auto grows_to = [&](std::size_t poses) {
    return within_seconds(20, [&] {
      ++sequence;
      client.send(sequence, client.bent(0.001 * static_cast<double>(sequence)));
      client.next_mesh(sequence);
      return read("long.ecrec.part", session).code == StatusCode::data_loss && session.steps.size() >= poses;
    });
  };
  EXPECT_TRUE(grows_to(1));
  const std::size_t before = session.steps.size();
  EXPECT_TRUE(grows_to(before + 10));
  for (std::size_t i = 0; i + 1 < session.steps.size(); ++i)
    EXPECT_EQ(session.steps[i].frames.size(), 1U) << i;
  EXPECT_EQ(session.head.model(), "toy");
  EXPECT_FALSE(fs::exists(folder_ / "long.ecrec"));
  client.client().call(record(false));
  ASSERT_TRUE(read("long.ecrec", session).ok());
  EXPECT_EQ(session.steps.size(), sequence);
  EXPECT_FALSE(fs::exists(folder_ / "long.ecrec.part"));
}

// What a killed server left has its name.
TEST_F(RecordingsTest, APartIsNotWrittenOver) {
  std::ofstream(folder_ / "old.ecrec.part") << "of a killed server";
  fs::create_symlink(folder_ / "elsewhere", folder_ / "linked.ecrec.part");
  const TestServer server(options());
  TestClient client(server);
  EXPECT_TRUE(says(refusal(client, record(true, "old")), "there is a recording 'old'"));
  EXPECT_EQ(refusal(client, record(true, "linked")), "") << "it seems not to be there";
  client.send(1, client.bent(0.1));
  client.next_ack();
  EXPECT_TRUE(says(refusal(client, record(false)), "record: its file cannot be made"));
  EXPECT_FALSE(fs::exists(folder_ / "elsewhere"));
}

TEST_F(RecordingsTest, OldOnesMakeWayWhereTheFolderIsFull) {
  Options options = this->options();
  options.limits.recording_files = 4;
  options.limits.recording_days = 30;
  const auto now = fs::file_time_type::clock::now();
  const auto put = [&](const std::string& name, int days) {
    std::ofstream(folder_ / name) << name;
    fs::last_write_time(folder_ / name, now - std::chrono::hours(24 * days));
  };
  put("new.ecrec", 1);
  put("old.ecrec", 40);
  put("older.ecrec.part", 50);
  put("notes.txt", 500);  // is no recording
  const TestServer server(options);
  TestClient client(server);
  EXPECT_EQ(refusal(client, record(true, "first")), "");
  EXPECT_FALSE(fs::exists(folder_ / "older.ecrec.part"));
  EXPECT_TRUE(fs::exists(folder_ / "old.ecrec"));
  client.send(1, client.bent(0.1));
  client.next_ack();
  client.client().call(record(false));
  EXPECT_EQ(refusal(client, record(true, "second")), "");
  EXPECT_FALSE(fs::exists(folder_ / "old.ecrec"));
  client.send(2, client.bent(0.1));
  client.next_ack();
  client.client().call(record(false));
  EXPECT_TRUE(says(refusal(client, record(true, "third")), "the server's folder is full"));
  EXPECT_EQ(files(), 4);
}

}  // namespace
}  // namespace ecorche::server
