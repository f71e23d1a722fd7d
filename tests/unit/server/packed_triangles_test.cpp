// SPDX-License-Identifier: Apache-2.0
// Packed triangles are those of the model, whatever corner they begin with, and come only to who asks.
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <thread>
#include <vector>

#include "proto/arrays.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

// Turned so that it begins with its lowest corner, which keeps the way it faces.
Triangle turned(Triangle triangle) {
  std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
  return triangle;
}

std::vector<Triangle> triangles_of(const Tissue& tissue) {
  std::vector<Triangle> triangles;
  for (Eigen::Index f = 0; f < tissue.F.rows(); ++f) {
    Triangle triangle{};
    for (Eigen::Index c = 0; c < 3; ++c)
      triangle[static_cast<std::size_t>(c)] = static_cast<std::uint32_t>(tissue.F(f, c));
    triangles.push_back(turned(triangle));
  }
  return triangles;
}

std::vector<Triangle> unpack(const v1::Tissue& tissue, const wire::Frame& frame) {
  std::span<const std::uint8_t> bytes;
  EXPECT_TRUE(wire::find(tissue.packed_triangles(), frame.payload, 1, bytes));
  std::vector<Triangle> triangles(tissue.triangle_count());
  EXPECT_EQ(meshopt_decodeIndexBuffer(triangles.data(), 3 * triangles.size(), sizeof(std::uint32_t),
                                      bytes.data(), bytes.size()),
            0);
  std::transform(triangles.begin(), triangles.end(), triangles.begin(), turned);
  return triangles;
}

wire::Frame open(const TestServer& server, bool packed) {
  RawClient client(server);
  client.send_hello();
  v1::Envelope request;
  request.set_request_id(5);
  request.mutable_open_model()->set_packed_triangles(packed);
  client.send(request);
  while (auto frame = client.receive()) {
    if (frame->envelope.has_model_opened()) return std::move(*frame);
  }
  ADD_FAILURE() << "no model was opened";
  return {};
}

bool all_packed(const v1::ModelOpened& opened) {
  return std::all_of(opened.tissues().begin(), opened.tissues().end(),
                     [](const v1::Tissue& tissue) { return tissue.has_packed_triangles(); });
}

bool all_plain(const v1::ModelOpened& opened) {
  return std::all_of(opened.tissues().begin(), opened.tissues().end(), [](const v1::Tissue& tissue) {
    return tissue.has_triangles() && !tissue.has_packed_triangles() && tissue.triangle_count() == 0;
  });
}

TEST(PackedTriangles, AreTheModels) {
  const TestServer server;
  wire::Frame frame = open(server, true);
  // They are packed beside the first clients.
  for (int tries = 0; tries < 200 && !all_packed(frame.envelope.model_opened()); ++tries) {
    EXPECT_TRUE(all_plain(frame.envelope.model_opened()));
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    frame = open(server, true);
  }
  const v1::ModelOpened& opened = frame.envelope.model_opened();
  ASSERT_TRUE(all_packed(opened));
  ASSERT_EQ(opened.tissues_size(), static_cast<int>(server.model().tissues.size()));
  for (int t = 0; t < opened.tissues_size(); ++t) {
    EXPECT_FALSE(opened.tissues(t).has_triangles());
    EXPECT_EQ(unpack(opened.tissues(t), frame),
              triangles_of(server.model().tissues[static_cast<std::size_t>(t)]));
  }
  EXPECT_TRUE(all_plain(open(server, false).envelope.model_opened()));
}

TEST(PackedTriangles, UntilThereAreSomeTheyComePlain) {
  TestHooks hooks;
  hooks.may_coarsen = [] { return false; };
  const TestServer server(Options{}, hooks);
  EXPECT_TRUE(all_plain(open(server, true).envelope.model_opened()));
}

}  // namespace
}  // namespace ecorche::server
