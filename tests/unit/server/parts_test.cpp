// SPDX-License-Identifier: Apache-2.0
// Levels of detail, regions, control nodes and rates against offline posing.
#include <atomic>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <semaphore>
#include <thread>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/wire/mesh_decoder.hpp>
#include "proto/arrays.hpp"
#include "runtime/server/registry/session_registry.hpp"
#include "runtime/server/session/mesh_rows.hpp"
#include "runtime/server/session/served_model.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

struct OfflineParts {
  explicit OfflineParts(const Pose& pose)
      : poser(std::make_shared<const Model>(test::toy_model())),
        body(poser.make_frame({.positions = true, .quantised = true, .normals = true})) {
    EXPECT_TRUE(poser.run(pose, runtime::Skinning::cor, poser.all_tissues(), body).ok());
  }
  runtime::BodyPoser poser;
  runtime::PosedBody body;
};

// A flat sheet of n x n vertices a millimetre apart.
Tissue sheet(int n) {
  Tissue tissue;
  tissue.V.resize(n * n, 3);
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) tissue.V.row(n * y + x) << static_cast<float>(x), static_cast<float>(y), 0.0F;
  }
  tissue.F.resize(2 * (n - 1) * (n - 1), 3);
  int f = 0;
  for (int y = 0; y + 1 < n; ++y) {
    for (int x = 0; x + 1 < n; ++x) {
      const int v = y * n + x;
      tissue.F.row(f++) << v, v + 1, v + n;
      tissue.F.row(f++) << v + 1, v + n + 1, v + n;
    }
  }
  return tissue;
}

void expect_parts(const MeshRows& rows, std::size_t vertices) {
  EXPECT_TRUE(std::is_sorted(rows.vertices.begin(), rows.vertices.end()));
  for (const std::uint32_t v : rows.vertices) EXPECT_LT(v, vertices);
  for (const std::uint32_t v : rows.triangles) EXPECT_LT(v, rows.vertices.size());
}

TEST(Parts, EachLevelHasAboutAQuarterOfTheTrianglesBefore) {
  const Tissue tissue = sheet(60);
  auto before = static_cast<double>(tissue.F.size());
  for (const MeshRows& level : make_levels(tissue)) {
    expect_parts(level, 3600);
    const auto now = static_cast<double>(level.triangles.size());
    if (before / 12 > 64) {
      EXPECT_NEAR(now / before, 0.25, 0.05);
    }
    EXPECT_GT(now, 0);
    before = now;
  }
}

TEST(Parts, LevelsAreMadeForTheTissuesThatSomebodyWants) {
  const ServedModel served("toy", std::make_shared<const Model>(test::toy_model()));
  EXPECT_FALSE(served.has_levels({1}));
  EXPECT_TRUE(served.has_levels({}));
  std::thread other([&] { served.make_levels({0, 1}); });
  served.make_levels({1, 2});
  other.join();
  EXPECT_TRUE(served.has_levels({0, 1, 2}));
  EXPECT_FALSE(served.has_levels({2, 3}));
  const MeshLevels whole = make_levels(served.model().tissues[1]);
  for (std::uint32_t level = 1; level <= coarsest_level; ++level) {
    EXPECT_EQ(served.level(level, 1).vertices, whole[level - 1].vertices);
    EXPECT_EQ(served.level(level, 1).triangles, whole[level - 1].triangles);
  }
}

bool soon(const std::function<bool()>& done) {
  for (int i = 0; i < 2000 && !done(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return done();
}

TEST(Parts, LevelsAreMadeBeforeAnybodyAsks) {
  const auto model = std::make_shared<const Model>(test::toy_model());
  std::vector<std::uint32_t> all(model->tissues.size());
  std::iota(all.begin(), all.end(), 0U);
  auto changed = std::make_shared<Model>(*model);
  changed->tissues[0].V.array() += 1e-3;
  net::io_context io;
  Workers workers(1, [](const Job& job) { job(); });
  SessionRegistry registry(io, workers, {}, {{"toy", model, {}, [changed] { return ModelParts{changed}; }}},
                           {});
  const auto first = registry.models()[0];
  EXPECT_TRUE(soon([&] { return first->has_levels(all); }));
  registry.reload("toy", [](const Status& status) { EXPECT_TRUE(status.ok()) << status.message; });
  io.run();
  ASSERT_NE(registry.models()[0], first);
  EXPECT_TRUE(soon([&] { return registry.models()[0]->has_levels(all); }));
}

TEST(Parts, LevelsThatNobodyWaitsForDoNotHoldUpTheEnd) {
  const auto model = std::make_shared<const Model>(test::toy_model());
  ASSERT_GT(model->tissues.size(), 2U);
  std::atomic<int> asked = 0;
  std::binary_semaphore stopped(0);
  {
    net::io_context io;
    Workers workers(1, [](const Job& job) { job(); });
    TestHooks hooks;
    hooks.may_coarsen = [&] {
      if (++asked == 1) stopped.acquire();
      return true;
    };
    SessionRegistry registry(io, workers, {}, {{"toy", model, {}, {}}}, hooks);
    registry.stop();
    stopped.release();
  }
  EXPECT_LE(asked, 1);
}

TestHooks on_demand() {
  TestHooks hooks;
  hooks.may_coarsen = [] { return false; };
  return hooks;
}

// A thread of its own makes them: whoever asks first may be gone by then.
TEST(Parts, WhoAsksForLevelsFirstMayLeaveBeforeTheyAreMade) {
  const TestServer server(Options{}, on_demand());
  v1::Envelope request;
  request.mutable_subscribe()->mutable_mesh()->set_level(2);
  {
    TestClient gone(server);
    request.set_request_id(77);
    gone.client().send(request);
  }
  TestClient client(server);
  EXPECT_TRUE(client.client().call(request).envelope.has_subscribed());
}

// Those that wait for their levels count, and no longer once they have them.
TEST(Parts, SubscriptionsThatWaitForLevelsAreLimitedToo) {
  Limits limits;
  limits.subscriptions = 2;
  Options options;
  options.limits = limits;
  const TestServer server(options, on_demand());
  RawClient client(server);
  client.send_hello();
  v1::Envelope open, request;
  open.mutable_open_model()->set_without_triangles(true);
  open.set_request_id(1);
  client.send(open);
  // Handled in one go: no level can be there yet. Returns how many were subscribed.
  const auto ask_for = [&](std::uint64_t count) {
    std::string bytes;
    for (std::uint64_t id = 101; id < 101 + count; ++id) {
      request.set_request_id(id);
      request.mutable_subscribe()->mutable_mesh()->set_level(static_cast<std::uint32_t>(id - 100));
      bytes += wire::encode(request).head;
    }
    client.send(bytes);
    int good = 0;
    for (std::uint64_t answers = 0; answers < count;) {
      const auto frame = client.receive();
      if (!frame) return -1;
      if (frame->envelope.request_id() <= 100) continue;
      ++answers;
      good += frame->envelope.has_subscribed() ? 1 : 0;
    }
    return good;
  };
  EXPECT_EQ(ask_for(3), 2);
  v1::Envelope drop;
  for (std::uint32_t subscription = 1; subscription <= 2; ++subscription) {
    drop.set_request_id(subscription);
    drop.mutable_unsubscribe()->set_subscription(subscription);
    client.send(drop);
  }
  EXPECT_EQ(ask_for(2), 2);
}

// The levels are of the model that was open; the subscription would be of another.
TEST(Parts, LevelsOfAModelThatMadeWayAreNotSubscribedTo) {
  TestServer server(Options{}, on_demand());
  RawClient client(server);
  client.send_hello();
  v1::Envelope open, subscribe, reload;
  open.mutable_open_model()->set_model("toy");
  open.mutable_open_model()->set_without_triangles(true);
  open.set_request_id(1);
  client.send(open);
  const auto next = [&](auto&& wanted) {
    auto frame = client.receive();
    while (frame && !wanted(frame->envelope)) frame = client.receive();
    return frame ? frame->envelope : v1::Envelope();
  };
  ASSERT_TRUE(next([](const v1::Envelope& e) { return e.has_model_opened(); }).has_model_opened());
  auto changed = std::make_shared<Model>(test::toy_model());
  changed->tissues[0].V.array() += 1e-3;
  server.reads([changed] { return ModelParts{changed}; });
  reload.mutable_reload_model()->set_model("toy");
  TestClient(server).client().call(reload);
  ASSERT_TRUE(next([](const v1::Envelope& e) { return e.has_model_changed(); }).has_model_changed());
  // Both in one go: the second is handled before a worker can have answered the first.
  subscribe.set_request_id(2);
  subscribe.mutable_subscribe()->mutable_mesh()->set_level(1);
  open.set_request_id(3);
  client.send(wire::encode(subscribe).head + wire::encode(open).head);
  const v1::Envelope answer = next([](const v1::Envelope& e) { return e.request_id() == 2; });
  EXPECT_NE(answer.status().message().find("another model was opened"), std::string::npos)
      << answer.status().message();
  subscribe.set_request_id(4);
  client.send(subscribe);
  EXPECT_TRUE(next([](const v1::Envelope& e) { return e.request_id() == 4; }).has_subscribed());
}

TEST(Parts, ABoxCutsVerticesAndTheTrianglesBetweenThem) {
  const Tissue tissue = sheet(10);
  const MeshRows rows = cut(tissue, nullptr, {.low = {2, 3, -1}, .high = {4, 5, 1}});
  expect_parts(rows, 100);
  EXPECT_EQ(rows.vertices, (std::vector<std::uint32_t>{32, 33, 34, 42, 43, 44, 52, 53, 54}));
  EXPECT_EQ(rows.triangles.size(), 3U * 8);
  const MeshRows again = cut(tissue, &rows, {.low = {2, 3, -1}, .high = {3, 4, 1}});
  EXPECT_EQ(again.vertices, (std::vector<std::uint32_t>{32, 33, 42, 43}));
  EXPECT_EQ(again.triangles.size(), 3U * 2);
  EXPECT_TRUE(cut(tissue, nullptr, {.low = {0, 0, 5}, .high = {9, 9, 6}}).vertices.empty());
}

// Every frame of a part is those rows of offline posing, in every encoding.
TEST(Parts, FramesOfLevelsAndRegionsAreRowsOfOfflinePosing) {
  for (const v1::Encoding encoding : {v1::ENCODING_F32, v1::ENCODING_U16, v1::ENCODING_U16_DELTA}) {
    for (const bool box : {false, true}) {
      const TestServer server;
      TestClient client(server);
      v1::Envelope request;
      v1::MeshSelection& mesh = *request.mutable_subscribe()->mutable_mesh();
      mesh.set_encoding(encoding);
      mesh.set_normals(true);
      mesh.set_level(box ? 0 : 1);
      if (box) {
        mesh.mutable_region()->mutable_min()->set_x(-100);
        mesh.mutable_region()->mutable_min()->set_y(-100);
        mesh.mutable_region()->mutable_min()->set_z(120);
        mesh.mutable_region()->mutable_max()->set_x(100);
        mesh.mutable_region()->mutable_max()->set_y(100);
        mesh.mutable_region()->mutable_max()->set_z(400);
      }
      const wire::Frame answer = client.client().call(request);
      const v1::Subscribed& subscribed = answer.envelope.subscribed();
      ASSERT_EQ(subscribed.levels_size(), 1);
      EXPECT_EQ(subscribed.levels(0).level(), box ? 0U : 1U);
      ASSERT_EQ(subscribed.levels(0).parts_size(), client.opened().tissues_size());
      wire::MeshDecoder decoder;
      std::vector<wire::DecodedTissue> tissues;
      std::size_t shown = 0, all = 0;
      for (std::uint64_t sequence = 0; sequence < 4; ++sequence) {
        const Pose pose = client.bent(0.2 * static_cast<double>(sequence));
        if (sequence > 0) client.send(sequence, pose);
        const wire::Frame frame = client.next_mesh(sequence);
        EXPECT_EQ(frame.envelope.mesh_frame().level(), box ? 0U : 1U);
        ASSERT_TRUE(decoder.decode(frame.envelope.mesh_frame(), frame.payload, tissues).ok());
        const OfflineParts offline(pose);
        if (encoding != v1::ENCODING_F32) {
          EXPECT_EQ(static_cast<float>(subscribed.step()), offline.body.box.step);
        }
        for (std::size_t t = 0; t < tissues.size(); ++t) {
          std::span<const std::uint32_t> rows;
          ASSERT_TRUE(wire::find(subscribed.levels(0).parts(static_cast<int>(t)).vertices(), answer.payload,
                                 1, rows));
          ASSERT_EQ(tissues[t].positions.size(), 3 * rows.size());
          ASSERT_EQ(tissues[t].normals.size(), 3 * rows.size());
          shown += rows.size();
          all += offline.body.tissues[t].size() / 3;
          for (std::size_t i = 0; i < 3 * rows.size(); ++i) {
            const std::size_t at = 3 * std::size_t{rows[i / 3]} + i % 3;
            if (encoding == v1::ENCODING_F32) {
              ASSERT_EQ(tissues[t].positions[i], offline.body.tissues[t][at]);
            } else {
              ASSERT_EQ(tissues[t].numbers[i], offline.body.quantised[t][at]);
            }
          }
        }
      }
      EXPECT_LT(shown, all);
      EXPECT_GT(shown, 0U);
    }
  }
}

// A client that moves the vertices itself gets what offline posing gets, but for rounding.
TEST(Parts, ControlNodesFinishedByTheClientAreOfflinePosing) {
  const TestServer server;
  TestClient client(server);
  v1::Envelope request;
  request.mutable_subscribe()->mutable_mesh()->set_control_nodes(true);
  const wire::Frame answer = client.client().call(request);
  const v1::Subscribed& subscribed = answer.envelope.subscribed();
  ASSERT_EQ(subscribed.bindings_size(), client.opened().tissues_size());
  const Pose pose = client.bent(0.5);
  client.send(1, pose);
  const wire::Frame frame = client.next_mesh(1);
  const v1::MeshFrame& mesh = frame.envelope.mesh_frame();
  ASSERT_EQ(mesh.arrays_size(), 2);
  std::span<const float> nodes;
  std::span<const double> segments;
  ASSERT_EQ(mesh.arrays(0).kind(), v1::MeshArray::KIND_NODES);
  ASSERT_TRUE(wire::find(mesh.arrays(0).array(), frame.payload, 3, nodes));
  ASSERT_EQ(mesh.arrays(1).kind(), v1::MeshArray::KIND_SEGMENTS);
  ASSERT_TRUE(wire::find(mesh.arrays(1).array(), frame.payload, 12, segments));
  EXPECT_EQ(segments.size(), 12 * server.model().segment_count());
  EXPECT_LE(nodes.size(), 3 * server.model().node_count());
  const OfflineParts offline(pose);
  int bones = 0, soft = 0;
  for (const v1::TissueBinding& binding : subscribed.bindings()) {
    const std::vector<float>& expected = offline.body.tissues[binding.tissue()];
    std::vector<double> got(expected.size());
    if (binding.segment() >= 0) {
      ++bones;
      std::span<const double> rest;
      ASSERT_TRUE(wire::find(binding.rest(), answer.payload, 3, rest));
      ASSERT_EQ(rest.size(), expected.size());
      const double* m = &segments[12 * static_cast<std::size_t>(binding.segment())];
      for (std::size_t i = 0; i < got.size(); ++i) {
        const double *row = m + 4 * (i % 3), *x = &rest[i - i % 3];
        got[i] = row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3];
      }
    } else {
      ++soft;
      std::span<const std::uint32_t> corners;
      std::span<const float> shares;
      ASSERT_TRUE(wire::find(binding.corners(), answer.payload, 4, corners));
      ASSERT_TRUE(wire::find(binding.barycentric(), answer.payload, 4, shares));
      ASSERT_EQ(corners.size() / 4, expected.size() / 3);
      for (std::size_t i = 0; i < got.size(); ++i) {
        for (std::size_t c = 0; c < 4; ++c) {
          ASSERT_LT(corners[4 * (i / 3) + c], nodes.size() / 3);
          got[i] += static_cast<double>(shares[4 * (i / 3) + c]) *
                    static_cast<double>(nodes[3 * std::size_t{corners[4 * (i / 3) + c]} + i % 3]);
        }
      }
    }
    for (std::size_t i = 0; i < got.size(); ++i) ASSERT_NEAR(got[i], expected[i], 1e-3);
  }
  EXPECT_GT(bones, 0);
  EXPECT_GT(soft, 0);
}

TEST(Parts, ARateHoldsFramesBackButNotTheLastOne) {
  const TestServer server;
  TestClient client(server);
  v1::Envelope request;
  request.mutable_subscribe()->mutable_mesh();
  request.mutable_subscribe()->set_max_rate(10);
  client.client().call(request);
  client.next_mesh(0);
  const auto start = client::Clock::now();
  for (std::uint64_t sequence = 1; sequence <= 50; ++sequence) {
    client.send(sequence, client.bent(0.01 * static_cast<double>(sequence)));
    std::this_thread::sleep_for(std::chrono::milliseconds(8));
  }
  int frames = 0;
  std::uint64_t last = 0;
  while (last < 50) {
    const wire::Frame frame = client.next([](const v1::Envelope& e) { return e.has_mesh_frame(); });
    last = frame.envelope.mesh_frame().pose_sequence();
    ++frames;
  }
  const double seconds = std::chrono::duration<double>(client::Clock::now() - start).count();
  EXPECT_LE(frames, 10 * seconds + 2);
  EXPECT_GE(frames, 3);
}

}  // namespace
}  // namespace ecorche::server
