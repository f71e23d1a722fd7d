// SPDX-License-Identifier: Apache-2.0
// Where the scan's border cuts the body, a client is told which vertices close it.
#include <string>

#include <ecorche/runtime/skin_caps.hpp>
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

// A toy whose upper end is a border of its scan.
Model capped_toy() {
  Model model = test::toy_model();
  model.provenance["skin_caps"] =
      "0 0 " + std::to_string(model.tissues[0].V.col(2).maxCoeff()) + " 0 0 1 0.5 17.6";
  return model;
}

bool marked(const std::string& bits, std::size_t vertex) {
  return (static_cast<unsigned char>(bits.at(vertex / 8)) >> vertex % 8 & 1) != 0;
}

TEST(CapVertices, MarkTheTrianglesThatAreNoSkinAndNoOther) {
  const TestServer server(Limits{}, capped_toy());
  const TestClient client(server);
  const Tissue& skin = server.model().tissues[0];
  const std::string& bits = client.opened().tissues(0).cap_vertices();
  ASSERT_EQ(bits.size(), (static_cast<std::size_t>(skin.V.rows()) + 7) / 8);
  const std::vector<std::uint8_t> faces = runtime::cap_faces(skin, runtime::skin_caps(server.model()));
  std::size_t count = 0;
  for (Eigen::Index f = 0; f < skin.F.rows(); ++f) {
    bool all = true;
    for (int c = 0; c < 3; ++c) all = all && marked(bits, static_cast<std::size_t>(skin.F(f, c)));
    EXPECT_EQ(all, faces[static_cast<std::size_t>(f)] != 0) << f;
    count += all ? 1 : 0;
  }
  EXPECT_GT(count, 0u);
  EXPECT_LT(count, static_cast<std::size_t>(skin.F.rows()));
  for (int t = 1; t < client.opened().tissues_size(); ++t)
    EXPECT_TRUE(client.opened().tissues(t).cap_vertices().empty());
}

TEST(CapVertices, AreNoneWhereNothingIsCut) {
  const TestServer server;
  const TestClient client(server);
  for (const v1::Tissue& tissue : client.opened().tissues()) EXPECT_TRUE(tissue.cap_vertices().empty());
}

}  // namespace
}  // namespace ecorche::server
