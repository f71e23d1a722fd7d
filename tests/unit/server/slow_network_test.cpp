// SPDX-License-Identifier: Apache-2.0
// 100 Mbit/s, 50 ms each way, 1 % loss, carried by a relay in this process (netem is not in every kernel).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/wire/mesh_decoder.hpp>
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/slow_relay.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

// The toy body with a sheet of 100 000 vertices down its middle: 1.2 MB a frame as float32, 96 ms of the
// network.
Model large_body() {
  Model model = test::toy_model();
  constexpr int across = 125, along = 800;
  Tissue sheet;
  sheet.name = "sheet";
  sheet.V.resize(across * along, 3);
  sheet.tet.resize(across * along);
  sheet.barycentric.resize(across * along, 4);
  const Eigen::Vector3f low = model.nodes.colwise().minCoeff(), high = model.nodes.colwise().maxCoeff();
  const auto corner = [&](Eigen::Index tet, int c) {
    return model.nodes.row(model.tets(tet, c)).transpose();
  };
  // Tets by slabs of z.
  constexpr int slabs = 60;
  const auto slab = [&](float z) {
    return std::clamp(static_cast<int>(slabs * (z - low.z()) / (high.z() - low.z())), 0, slabs - 1);
  };
  std::vector<std::vector<std::int32_t>> within(slabs);
  for (std::int32_t t = 0; t < model.tets.rows(); ++t) {
    float from = 1e9F, to = -1e9F;
    for (int c = 0; c < 4; ++c) {
      from = std::min(from, corner(t, c).z());
      to = std::max(to, corner(t, c).z());
    }
    for (int s = slab(from); s <= slab(to); ++s) within[static_cast<std::size_t>(s)].push_back(t);
  }
  for (int v = 0; v < across * along; ++v) {
    const Eigen::Vector3f share(0.02F + 0.96F * static_cast<float>(v % across) / (across - 1), 0.47F,
                                0.02F + 0.96F * static_cast<float>(v / across) / (along - 1));
    const Eigen::Vector3f x = low + share.cwiseProduct(high - low);
    sheet.V.row(v) = x;
    float best = -1e9F;
    for (const std::int32_t t : within[static_cast<std::size_t>(slab(x.z()))]) {
      Eigen::Matrix3f edges;
      for (int c = 0; c < 3; ++c) edges.col(c) = corner(t, c + 1) - corner(t, 0);
      const Eigen::Vector3f b = edges.inverse() * (x - corner(t, 0));
      const Eigen::Vector4f all(1 - b.sum(), b.x(), b.y(), b.z());
      if (all.minCoeff() <= best) continue;
      best = all.minCoeff();
      sheet.tet[static_cast<std::size_t>(v)] = t;
      sheet.barycentric.row(v) = all;
    }
  }
  sheet.F.resize(2 * (across - 1) * (along - 1), 3);
  int f = 0;
  for (int y = 0; y + 1 < along; ++y) {
    for (int x = 0; x + 1 < across; ++x) {
      const int v = y * across + x;
      sheet.F.row(f++) << v, v + 1, v + across;
      sheet.F.row(f++) << v + 1, v + across + 1, v + across;
    }
  }
  model.tissues.push_back(std::move(sheet));
  return model;
}

struct Seen {
  std::vector<double> ms;
  std::map<std::uint32_t, int> levels;
};

// Walks for `seconds` at 60 Hz; what arrives in the first `settling` of them does not count.
Seen walk(TestClient& client, wire::MeshDecoder& decoder, std::uint64_t& sequence, double seconds,
          double settling) {
  using client::Clock;
  const auto span = [](double s) {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
  };
  std::map<std::uint64_t, Clock::time_point> sent;
  std::vector<wire::DecodedTissue> tissues;
  Seen seen;
  const auto start = Clock::now();
  auto due = start;
  while (Clock::now() < start + span(seconds)) {
    if (Clock::now() >= due) {
      ++sequence;
      client.send(sequence, client.bent(0.5 * std::sin(0.1 * static_cast<double>(sequence))));
      sent[sequence] = Clock::now();
      due += span(1.0 / 60);
    }
    const auto frame = client.client().receive(due);
    if (!frame || !frame->envelope.has_mesh_frame()) continue;
    const v1::MeshFrame& mesh = frame->envelope.mesh_frame();
    EXPECT_TRUE(decoder.decode(mesh, frame->payload, tissues).ok());
    if (Clock::now() < start + span(settling) || !sent.contains(mesh.pose_sequence())) continue;
    seen.ms.push_back(
        std::chrono::duration<double, std::milli>(Clock::now() - sent[mesh.pose_sequence()]).count());
    ++seen.levels[mesh.level()];
  }
  return seen;
}

TEST(SlowNetwork, TheStreamLowersItsDetailAndComesBack) {
  const Model model = large_body();
  const TestServer server({}, model);
  for (const v1::Encoding encoding : {v1::ENCODING_F32, v1::ENCODING_U16_DELTA}) {
    const SlowRelay relay(server.address(), Network{});
    TestClient client(relay.address());
    v1::Envelope request;
    request.mutable_subscribe()->mutable_mesh()->set_encoding(encoding);
    request.mutable_subscribe()->mutable_mesh()->set_adaptive(true);
    client.client().call(request);
    wire::MeshDecoder decoder;
    std::uint64_t sequence = 0;
    Seen seen = walk(client, decoder, sequence, 6, 2);
    const auto stopped = client::Clock::now();
    ASSERT_GT(seen.ms.size(), 20U);
    std::sort(seen.ms.begin(), seen.ms.end());
    const double p95 = seen.ms[seen.ms.size() * 95 / 100];
    std::printf("encoding %d: %zu frames in 4 s, p50 %.0f, p95 %.0f, most %.0f ms; levels", encoding,
                seen.ms.size(), seen.ms[seen.ms.size() / 2], p95, seen.ms.back());
    for (const auto& [level, count] : seen.levels) std::printf(" %u: %d", level, count);
    EXPECT_LE(p95, 250);
    EXPECT_LE(seen.ms.back(), 1000);

    // The last pose, whole, and right.
    const wire::Frame whole = [&] {
      std::vector<wire::DecodedTissue> tissues;
      while (true) {
        wire::Frame frame = client.next([](const v1::Envelope& e) { return e.has_mesh_frame(); });
        const v1::MeshFrame& mesh = frame.envelope.mesh_frame();
        if (mesh.pose_sequence() == sequence && mesh.level() == 0) return frame;
        EXPECT_TRUE(decoder.decode(mesh, frame.payload, tissues).ok());
      }
    }();
    const double after = std::chrono::duration<double>(client::Clock::now() - stopped).count();
    std::printf("; full detail %.2f s after the last pose\n", after);
    EXPECT_LE(after, 1.0);
    std::vector<wire::DecodedTissue> tissues;
    ASSERT_TRUE(decoder.decode(whole.envelope.mesh_frame(), whole.payload, tissues).ok());
    const runtime::BodyPoser poser(std::make_shared<const Model>(model));
    runtime::PosedBody body = poser.make_frame();
    const Pose pose = client.bent(0.5 * std::sin(0.1 * static_cast<double>(sequence)));
    ASSERT_TRUE(poser.run(pose, runtime::Skinning::cor, poser.all_tissues(), body).ok());
    const float bound =
        encoding == v1::ENCODING_F32 ? 0 : whole.envelope.mesh_frame().box().step() / 2 + 1e-3F;
    for (const wire::DecodedTissue& tissue : tissues) {
      ASSERT_EQ(tissue.positions.size(), body.tissues[tissue.tissue].size());
      for (std::size_t i = 0; i < tissue.positions.size(); ++i)
        ASSERT_NEAR(tissue.positions[i], body.tissues[tissue.tissue][i], bound);
    }
  }
}

}  // namespace
}  // namespace ecorche::server
