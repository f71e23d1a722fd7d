// SPDX-License-Identifier: Apache-2.0
// Many who look at one body, many messages at once, numbers beyond all sense.
#include <array>
#include <atomic>
#include <map>
#include <set>

#include "tests/unit/server/test_server.hpp"
#include "tests/unit/server/web_client.hpp"

namespace ecorche::server {
namespace {

// The value of a sample of the page.
double sample(const TestServer& server, const std::string& name) {
  const std::string page = WebClient(server.http()).get("/metrics");
  const auto at = page.find("\n" + name + " ");
  return at == std::string::npos ? -1 : std::stod(page.substr(at + name.size() + 2));
}

TEST(Crowd, EveryFrameIsPosedAndEncodedOnceForAll) {
  Options options;
  options.http = Endpoint{};
  const TestServer server(options);
  TestClient poser(server, "shared");
  constexpr std::size_t watching = 7;
  std::vector<std::unique_ptr<TestClient>> observers;
  observers.reserve(watching);
  for (std::size_t i = 0; i < watching; ++i)
    observers.push_back(std::make_unique<TestClient>(server, "shared"));
  const auto subscribe = [](TestClient& client) {
    v1::Envelope request;
    request.mutable_subscribe()->mutable_mesh()->set_encoding(v1::ENCODING_U16_DELTA);
    request.mutable_subscribe()->mutable_mesh()->set_normals(true);
    return client.client().call(request).envelope.subscribed().subscription();
  };
  const std::uint32_t number = subscribe(poser);
  poser.next_mesh(0);
  for (const auto& observer : observers) {
    EXPECT_EQ(subscribe(*observer), number);
    observer->next_mesh(0);
  }
  constexpr std::array kCounts{"ecorche_stage_seconds_count{stage=\"posed\"}",
                               "ecorche_stage_seconds_count{stage=\"encoded\"}", "ecorche_frames_sent_total"};
  // What was made for those who joined has left.
  poser.send(1, poser.bent(0.01));
  poser.next_mesh(1);
  for (const auto& observer : observers) observer->next_mesh(1);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  std::array<double, 3> before{};
  for (std::size_t i = 0; i < kCounts.size(); ++i) before[i] = sample(server, kCounts[i]);
  for (std::uint64_t sequence = 2; sequence <= 11; ++sequence) {
    poser.send(sequence, poser.bent(0.02 * static_cast<double>(sequence)));
    const wire::Frame mine = poser.next_mesh(sequence);
    for (const auto& observer : observers) EXPECT_EQ(observer->next_mesh(sequence).payload, mine.payload);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // what has come is counted a little later
  const std::array<double, 3> more{10, 10, 80};
  for (std::size_t i = 0; i < kCounts.size(); ++i)
    EXPECT_EQ(sample(server, kCounts[i]) - before[i], more[i]) << kCounts[i];
}

// The slot keeps the newest pose alone; what was asked between poses is answered all the same, in order.
TEST(Crowd, CommandsBetweenPosesThatAreSkippedAreAllAnswered) {
  const TestServer server;
  TestClient client(server);
  client.subscribe_mesh();
  client.next_mesh(0);
  constexpr std::uint64_t kPoses = 400;
  std::vector<std::uint64_t> asked;
  for (std::uint64_t sequence = 1; sequence <= kPoses; ++sequence) {
    client.send(sequence, client.bent(0.001 * static_cast<double>(sequence)));
    if (sequence % 4 != 0) continue;
    v1::Envelope command;
    command.set_request_id(10'000 + sequence);
    switch (sequence / 4 % 4) {
      case 0:
        command.mutable_ping();
        break;
      case 1:
        command.mutable_set_thresholds()->set_max_volume_change(0.5);
        break;
      case 2:
        command.mutable_list_clips();
        break;
      default:
        command.mutable_unsubscribe()->set_subscription(99);  // refused, which is an answer
    }
    client.client().send(command);
    asked.push_back(command.request_id());
  }
  std::vector<std::uint64_t> answered;
  std::set<std::uint64_t> accounted;  // poses, acknowledged or skipped
  std::uint64_t skipped = 0, acknowledged = 0;
  while (acknowledged + skipped < kPoses || answered.size() < asked.size()) {
    const v1::Envelope got = client.next([](const v1::Envelope& e) { return !e.has_mesh_frame(); }).envelope;
    if (got.request_id() != 0) answered.push_back(got.request_id());
    if (!got.has_pose_ack()) continue;
    ++acknowledged;
    skipped += got.pose_ack().skipped();
    EXPECT_EQ(got.pose_ack().status().code(), 0U);
    EXPECT_TRUE(accounted.insert(got.pose_ack().sequence()).second);
    // The newest 256 by name.
    for (const std::uint64_t sequence : got.pose_ack().skipped_sequences())
      EXPECT_TRUE(accounted.insert(sequence).second) << sequence;
  }
  EXPECT_EQ(answered, asked);
  EXPECT_EQ(acknowledged + skipped, kPoses);
  EXPECT_TRUE(accounted.contains(kPoses)) << "the newest is shown";
  EXPECT_GT(skipped, 0U);
}

// To say what parts of a large body hold takes long: it is done where levels are made and models are read.
TEST(Crowd, WhoAsksForPartsHoldsNobodyUp) {
  TestServer server;
  std::atomic<bool> reading = false, go_on = false;
  server.reads([&]() -> ModelParts {
    reading = true;
    while (!go_on) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    throw Error(ErrorKind::data, "toy.hdf", "is cut", "copy it again");
  });
  TestClient other(server), asks(server);
  other.subscribe_mesh();
  v1::Envelope reload, nodes, region;
  reload.set_request_id(901);
  reload.mutable_reload_model()->set_model("toy");
  other.client().send(reload);
  while (!reading) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  nodes.set_request_id(902);
  nodes.mutable_subscribe()->mutable_mesh()->set_control_nodes(true);
  region.set_request_id(903);
  region.mutable_subscribe()->mutable_mesh()->mutable_region()->mutable_max()->set_z(50);
  for (const v1::Envelope& request : {nodes, region}) asks.client().send(request);
  for (std::uint64_t sequence = 1; sequence <= 10; ++sequence) {
    other.send(sequence, other.bent(0.01 * static_cast<double>(sequence)));
    other.next_mesh(sequence);
  }
  EXPECT_FALSE(asks.client().receive(client::Clock::now() + std::chrono::milliseconds(50)));
  go_on = true;
  std::set<std::uint32_t> numbers;
  for (const std::uint64_t id : {902, 903}) {
    const v1::Envelope got = asks.next([&](const v1::Envelope& e) { return e.request_id() == id; }).envelope;
    numbers.insert(got.subscribed().subscription());
    EXPECT_EQ(got.subscribed().bindings_size() > 0, id == 902);
    EXPECT_EQ(got.subscribed().levels_size() > 0, id == 903);
  }
  EXPECT_EQ(numbers.size(), 2U);
}

// Whatever a client means by them, it gets an answer, and the server lives.
TEST(Crowd, NumbersBeyondAllSenseAreRefusedOrShown) {
  const TestServer server;
  TestClient client(server);
  const std::string ct = server.model().volumes[0].name;
  const auto sends = [&](const v1::Envelope& request) {
    std::uint32_t number = 0;
    try {
      number = client.client().call(request).envelope.subscribed().subscription();
    } catch (const Error&) {
      return;  // refused
    }
    if (!request.has_subscribe()) return;
    client.next([&](const v1::Envelope& e) {
      return e.volume_frame().subscription() == number || e.mesh_frame().subscription() == number;
    });
    v1::Envelope enough;
    enough.mutable_unsubscribe()->set_subscription(number);
    client.client().call(enough);
  };
  for (const double x : {5e-324, 1e-300, 1e-30, 1e30, 1e160, 1e300, 1.7e308}) {
    SCOPED_TRACE(x);
    for (const v1::Deformer deformer : {v1::DEFORMER_TETS, v1::DEFORMER_SPHERES}) {
      for (const double from : {0.0, x, -x}) {
        v1::Envelope plane, region;
        v1::VolumeSelection& cut = *plane.mutable_subscribe()->mutable_volume();
        cut.set_volume(ct);
        cut.set_deformer(deformer);
        v1::Slice& slice = *cut.add_slices();
        slice.mutable_origin()->set_x(from);
        slice.mutable_u()->set_y(x);
        slice.mutable_v()->set_z(x);
        slice.set_size_u(5);
        slice.set_size_v(7);
        sends(plane);
        v1::VolumeSelection& part = *region.mutable_subscribe()->mutable_volume();
        part.set_volume(ct);
        part.set_deformer(deformer);
        v1::Box& box = *part.mutable_region();
        for (v1::Vector3* corner : {box.mutable_min(), box.mutable_max()}) {
          const double value = corner == &box.min() ? std::min(from, 0.0) : x;
          corner->set_x(value);
          corner->set_y(value);
          corner->set_z(value);
        }
        sends(region);
        v1::Envelope mesh;
        *mesh.mutable_subscribe()->mutable_mesh()->mutable_region() = box;
        sends(mesh);
      }
    }
    v1::Envelope rated;
    rated.mutable_subscribe()->set_max_rate(x);
    rated.mutable_subscribe()->mutable_mesh();
    sends(rated);
    v1::Envelope solve;
    v1::IkTarget& target = *solve.mutable_solve_ik()->add_targets();
    target.set_segment(2);
    target.set_weight(x);
    target.mutable_target()->set_x(x);
    sends(solve);
  }
  client.subscribe_mesh();
  client.send(1, client.bent(0.2));
  client.next_mesh(1);
}

}  // namespace
}  // namespace ecorche::server
