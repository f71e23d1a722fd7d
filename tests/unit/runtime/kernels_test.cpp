// SPDX-License-Identifier: Apache-2.0
// The vector kernels against double precision and against every other instruction set of this machine, on
// bodies made to hurt: tails, clusters of one segment, 65 535 segments, full palettes.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <bit>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include <ecorche/kinematics/forward.hpp>
#include "runtime/skin/body_parts.hpp"
#include "runtime/skin/skin_clusters.hpp"
#include "tests/support/instruction_sets.hpp"
#include "tests/unit/runtime/clouds.hpp"
#include "tests/unit/runtime/reference_skinning.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
constexpr Skinning kEverySkinning[] = {Skinning::lbs, Skinning::dqs, Skinning::cor};

double farthest(const std::vector<float>& a, const std::vector<float>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    worst = std::max(worst, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
  }
  return worst;
}

void expect_right(const Shape& shape, double turn) {
  SCOPED_TRACE(std::to_string(shape.nodes) + " nodes, " + std::to_string(shape.segments) + " segments");
  const Model model = cloud(shape, 7), kept = as_kept(model);
  const BodyParts parts(model);
  const auto segments = random_segments(shape.segments, turn, 8);
  for (const Skinning skinning : kEverySkinning) {
    SCOPED_TRACE(skinning_name(skinning));
    const auto nodes = test::reference_nodes(kept, segments, skinning, 0);
    const auto vertices = test::reference_tissue(kept, kept.tissues[0], segments, nodes);
    std::vector<float> first_nodes, first_vertices;
    test::for_instruction_sets([&] {
      PosedBody body = frame_of(parts, model, segments);
      pose(parts, model, skinning, body);
      EXPECT_LT(test::farthest(body.nodes, nodes), 0.05);
      EXPECT_LT(test::farthest(body.tissues[0], vertices), 0.05);
      if (first_nodes.empty()) {
        first_nodes = body.nodes;
        first_vertices = body.tissues[0];
      }
      EXPECT_LT(farthest(body.nodes, first_nodes), 0.01);
      EXPECT_LT(farthest(body.tissues[0], first_vertices), 0.01);
    });
  }
}

TEST(Kernels, TheInstructionSetsOfThisMachine) {
  std::string names;
  for (const std::string& name : test::instruction_sets()) names += " " + name;
  std::printf("instruction sets:%s\n", names.c_str());
  EXPECT_FALSE(names.empty());
}

TEST(Kernels, TailsOfEveryLength) {
  for (const std::size_t nodes : {1, 2, 15, 16, 17, 63, 64, 65, 127, 129, 200}) {
    expect_right({nodes, 5, 3, 1 + nodes % 37}, 1);
  }
}

TEST(Kernels, OneSegment) {
  expect_right({300, 1, 1, 50}, 3);
}

TEST(Kernels, ManySegmentsANode) {
  expect_right({700, 60, 20, 333}, 0.8);
}

TEST(Kernels, As65535Segments) {
  expect_right({5000, 65535, 6, 100}, 0.8);
}

TEST(Kernels, PalettesAtTheirLimit) {
  const Model model = cloud({5000, 20, 4, 160}, 3);
  const BodyParts parts(model);
  std::uint32_t most = 0;
  for (const auto& cell : parts.groups(0).cells) most = std::max(most, cell.count);
  EXPECT_EQ(most, VertexGroups::most_lanes);
  expect_right({5000, 20, 4, 160}, 1);
  // A cluster whose palette is longer than it has nodes: 64 nodes with up to 50 of 3000 segments each.
  const Model wide = cloud({64, 3000, 50, 16}, 4);
  EXPECT_GT(BodyParts(wide).clusters().palette.size(), 1000u);
  expect_right({64, 3000, 50, 16}, 0.5);
}

TEST(Kernels, ATissueWithoutVerticesAndABodyThatNoTissueNeeds) {
  Model model = cloud({100, 4, 3, 20}, 5);
  model.tissues[0] = Tissue{};
  model.tissues[0].name = "empty";
  const BodyParts parts(model);
  EXPECT_EQ(parts.clusters().needed, 0u);
  const auto segments = random_segments(4, 1, 6);
  PosedBody body = frame_of(parts, model, segments);
  pose(parts, model, Skinning::cor, body, NodesOf::tissues);
  EXPECT_EQ(skinned(body), 0u);
  pose(parts, model, Skinning::cor, body);
  EXPECT_LT(test::farthest(body.nodes, test::reference_nodes(as_kept(model), segments, Skinning::cor, 0)),
            0.05);
}

TEST(Kernels, NodesOfTissuesGiveTheSameTissues) {
  const Model model = cloud({3000, 9, 4, 100}, 9);
  const BodyParts parts(model);
  const auto segments = random_segments(9, 1, 10);
  PosedBody all = frame_of(parts, model, segments), some = frame_of(parts, model, segments);
  pose(parts, model, Skinning::cor, all);
  pose(parts, model, Skinning::cor, some, NodesOf::tissues);
  EXPECT_EQ(all.tissues, some.tissues);
  EXPECT_LT(skinned(some), skinned(all) / 2);
  EXPECT_EQ(skinned(some), (parts.clusters().needed + 63) / 64);
}

TEST(Kernels, VanishedBlendsFollowTheHeaviestSegment) {
  Model model = cloud({70, 3, 1, 8}, 11);
  model.weights = {};
  model.weights.offsets = {0};
  for (std::size_t n = 0; n < 70; ++n) {
    // Two segments a whole turn apart, in shares so near that their blend has no length.
    const float first = n % 2 == 0 ? 0.5002F : 0.4998F;
    model.weights.segment.insert(model.weights.segment.end(), {1, 2});
    model.weights.weight.insert(model.weights.weight.end(), {first, 1 - first});
    model.weights.offsets.push_back(2 * (n + 1));
  }
  std::vector<RigidTransform> segments(3);
  segments[1].t = {10, 0, 0};
  segments[2].t = {0, 20, 0};
  segments[2].q.coeffs() *= -1;
  const BodyParts parts(model);
  for (const Skinning skinning : kEverySkinning) {
    test::for_instruction_sets([&] {
      PosedBody body = frame_of(parts, model, segments);
      pose(parts, model, skinning, body);
      std::vector<Vector3d> expected = test::points_of(model.nodes);
      for (std::size_t n = 0; n < 70; ++n) {
        const double first = n % 2 == 0 ? 0.5002 : 0.4998;
        const double share = skinning != Skinning::dqs ? first : n % 2 == 0 ? 1 : 0;
        expected[n] += share * segments[1].t + (1 - share) * segments[2].t;
      }
      EXPECT_LT(test::farthest(body.nodes, expected), 2e-3) << skinning_name(skinning);
    });
  }
}

}  // namespace
}  // namespace ecorche::runtime
