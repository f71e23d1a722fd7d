// SPDX-License-Identifier: Apache-2.0
// How the kernels lay out bodies: for threads, for tissues, and in the numbers of the wire.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "runtime/skin/body_parts.hpp"
#include "runtime/skin/skin_clusters.hpp"
#include "tests/support/instruction_sets.hpp"
#include "tests/unit/runtime/clouds.hpp"
#include "tests/unit/runtime/reference_skinning.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

// Slabs, runs of cells across where threads meet, and bones: as many threads as there are, or more.
TEST(Kernels, AnyNumberOfThreadsGivesTheSameBytes) {
  constexpr std::size_t kNodes = 80000;
  Model model = cloud({kNodes, 9, 4, 18000}, 14);
  Tissue bone = model.tissues[0];
  bone.segment = 3;
  bone.tet.clear();
  bone.barycentric.resize(0, 4);
  model.tissues.push_back(bone);
  Model near = model;  // some of its cells reach into the slab before, none further
  std::vector<Eigen::Index> along(kNodes);
  std::iota(along.begin(), along.end(), 0);
  std::sort(along.begin(), along.end(), [&](auto a, auto b) { return near.nodes(a, 2) < near.nodes(b, 2); });
  for (Eigen::Index t = 0; t < near.tets.rows(); ++t) {
    for (int c = 0; c < 4; ++c)
      near.tets(t, c) = static_cast<int>(along[static_cast<std::size_t>(4 * t + c)]);
  }
  near.nodes.col(2) *= 2;               // slabs lie along it
  near.tets.row(0) = near.tets.row(1);  // or cells, of 64 nodes that follow each other, end where slabs do
  for (const Model* each : {&model, &near}) {
    const BodyParts parts(*each);
    EXPECT_GT(parts.clusters().needed, 4 * NodeClusters::slab);
    std::size_t furthest = 0;
    for (const auto& cell : parts.groups(0).cells)
      furthest = std::max(furthest, parts.groups(0).last_slab(cell) - parts.groups(0).first_slab(cell));
    EXPECT_EQ(furthest == 1, each == &near) << furthest;
    const auto segments = random_segments(9, 1, 15);
    const auto nodes = test::reference_nodes(as_kept(*each), segments, Skinning::cor, 0);
    const auto vertices = test::reference_tissue(*each, each->tissues[0], segments, nodes);
    PosedBody first = frame_of(parts, *each, segments);
    const std::vector<std::uint32_t> tissues{0, 1}, other{1};
    parts.pose(*each, Skinning::cor, tissues, NodesOf::body, first);
    // More threads than cores, so that they meet where they do not by themselves.
    const tbb::global_control many(tbb::global_control::max_allowed_parallelism, 4);
    for (const int threads : {1, 2, 4}) {
      SCOPED_TRACE(threads);
      PosedBody body = frame_of(parts, *each, segments);
      for (int again = 0; again < 25; ++again) {
        // What was posed before must not be taken for what is.
        std::fill(body.scratch.lanes.begin(), body.scratch.lanes.end(), std::nanf(""));
        for (auto& of_tissue : body.tissues) std::fill(of_tissue.begin(), of_tissue.end(), 0.0F);
        tbb::task_arena(threads).execute(
            [&] { parts.pose(*each, Skinning::cor, tissues, NodesOf::body, body); });
        ASSERT_EQ(body.nodes, first.nodes);
        ASSERT_EQ(body.tissues, first.tissues);
        ASSERT_EQ(body.quantised, first.quantised);
        ASSERT_EQ(body.normals, first.normals);
      }
      std::fill(body.tissues[0].begin(), body.tissues[0].end(), 0.0F);
      parts.pose(*each, Skinning::cor, other, NodesOf::body, body);
      EXPECT_EQ(body.tissues[0], std::vector<float>(body.tissues[0].size())) << "it was not asked for";
      EXPECT_LT(test::farthest(first.tissues[0], vertices), 0.05);
    }
  }
}

TEST(Kernels, NodesOfTheSameTissuesLieTogether) {
  Model model = cloud({3000, 2, 1, 400}, 12);
  // Four tissues instead of one; every ninth vertex belongs to two of them, as where tissues touch.
  const Tissue whole = model.tissues[0];
  model.tissues.clear();
  for (int t = 0; t < 4; ++t) {
    std::vector<Eigen::Index> rows;
    for (Eigen::Index v = 0; v < 400; ++v) {
      if (v / 100 == t || (v % 9 == 0 && (v / 100 + 1) % 4 == t)) rows.push_back(v);
    }
    Tissue& tissue = model.tissues.emplace_back();
    tissue.name = "part" + std::to_string(t);
    tissue.V = whole.V(rows, Eigen::all);
    tissue.barycentric = whole.barycentric(rows, Eigen::all);
    tissue.F.resize(0, 3);
    for (const Eigen::Index v : rows) tissue.tet.push_back(whole.tet[static_cast<std::size_t>(v)]);
  }
  std::vector<std::set<std::size_t>> tissues(model.node_count());
  for (std::size_t t = 0; t < 4; ++t) {
    for (const std::int32_t tet : model.tissues[t].tet) {
      for (int c = 0; c < 4; ++c) tissues[static_cast<std::size_t>(model.tets(tet, c))].insert(t);
    }
  }
  const BodyParts parts(model);
  const NodeClusters& clusters = parts.clusters();
  // The segments that a node hangs on and its tissues, in the order of lanes.
  std::vector<std::pair<std::set<int>, std::set<std::size_t>>> kinds;
  for (std::size_t lane = 0; lane < clusters.nodes; ++lane) {
    const std::uint32_t node = clusters.node[lane];
    EXPECT_EQ(tissues[node].empty(), lane >= clusters.needed);
    std::set<int> segments;
    for (auto e = model.weights.offsets[node]; e < model.weights.offsets[node + 1]; ++e)
      segments.insert(model.weights.segment[e]);
    const std::pair kind{segments, tissues[node]};
    if (!tissues[node].empty() && (kinds.empty() || kinds.back() != kind)) kinds.push_back(kind);
  }
  EXPECT_EQ(kinds.size(), std::set(kinds.begin(), kinds.end()).size()) << "a kind lies in two places";
  EXPECT_GT(kinds.size(), 8U);

  // One tissue's frame: its own clusters, and the same bytes.
  const auto segments = random_segments(9, 1, 13);
  PosedBody all = frame_of(parts, model, segments), some = frame_of(parts, model, segments);
  const std::vector<std::uint32_t> third{2};
  for (const auto& [body, nodes] : {std::pair{&all, NodesOf::body}, {&some, NodesOf::tissues}}) {
    parts.pose(model, Skinning::cor, third, nodes, *body);
  }
  EXPECT_EQ(all.tissues[2], some.tissues[2]);
  EXPECT_LT(64 * skinned(some), clusters.needed * 3 / 4);
}

TEST(Kernels, QuantisedPositionsAndNormals) {
  Model model = cloud({900, 6, 3, 200}, 12);
  const BodyParts parts(model);
  const auto segments = random_segments(6, 0.3, 13);
  test::for_instruction_sets([&] {
    PosedBody body = frame_of(parts, model, segments);
    pose(parts, model, Skinning::cor, body);
    const Tissue& tissue = model.tissues[0];
    const PointsF rest = rest_normals(tissue);
    for (std::size_t v = 0; v < body.tissues[0].size() / 3; ++v) {
      Vector3d e[3];
      for (int c = 0; c < 3; ++c) {
        for (int k = 0; k < 3; ++k) {
          const auto at = [&](int corner) {
            const auto node = static_cast<std::size_t>(model.tets(tissue.tet[v], corner));
            return static_cast<double>(body.nodes[3 * node + static_cast<std::size_t>(k)]);
          };
          e[c][k] = at(c + 1) - at(0);
        }
      }
      Eigen::Matrix3d before;
      for (int c = 0; c < 3; ++c) {
        before.col(c) = (model.nodes.row(model.tets(tissue.tet[v], c + 1)) -
                         model.nodes.row(model.tets(tissue.tet[v], 0)))
                            .cast<double>()
                            .transpose();
      }
      const Vector3d n = rest.row(static_cast<Eigen::Index>(v)).cast<double>().transpose();
      const Vector3d g = before.transpose() * n;
      const Vector3d expected = g[0] * e[1].cross(e[2]) + g[1] * e[2].cross(e[0]) + g[2] * e[0].cross(e[1]);
      Vector3d found;
      for (int k = 0; k < 3; ++k) {
        const std::size_t i = 3 * v + static_cast<std::size_t>(k);
        found[k] = body.normals[0][i] / 32767.0;
        const double p = static_cast<double>(body.box.low[static_cast<std::size_t>(k)]) +
                         static_cast<double>(body.box.step) * body.quantised[0][i];
        if (body.quantised[0][i] == 0 || body.quantised[0][i] == 65535) continue;
        EXPECT_NEAR(p, static_cast<double>(body.tissues[0][i]),
                    0.51 * static_cast<double>(body.box.step) + 1e-3);
      }
      if (n.norm() == 0) {
        EXPECT_EQ(found.norm(), 0);
      } else {
        // Shares are i16, and a random tet may be so flat that they say little.
        const double left = expected.norm() /
                            (e[1].cross(e[2]).norm() + e[2].cross(e[0]).norm() + e[0].cross(e[1]).norm()) /
                            g.cwiseAbs().maxCoeff();
        if (left < 0.02) continue;
        EXPECT_NEAR(found.norm(), 1, 1e-3);
        EXPECT_LT((found - expected.normalized()).norm(), 1e-3 + 1e-4 / left) << v;
      }
    }
  });
}

TEST(Weights, SumToTheWholeAndStayNear) {
  std::mt19937 random(14);
  std::uniform_real_distribution<double> unit(0, 1);
  for (std::size_t count = 1; count < 400; ++count) {
    std::vector<double> weights(count);
    for (double& w : weights) w = unit(random);
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (double& w : weights) w /= sum;
    std::vector<std::uint16_t> out(count);
    quantise_weights(weights, out);
    EXPECT_EQ(std::accumulate(out.begin(), out.end(), 0), 65535);
    for (std::size_t i = 0; i < count; ++i) EXPECT_LT(std::abs(out[i] - 65535 * weights[i]), 1.0001);
  }
}

}  // namespace
}  // namespace ecorche::runtime
