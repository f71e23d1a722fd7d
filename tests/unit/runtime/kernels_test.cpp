// SPDX-License-Identifier: Apache-2.0
// The vector kernels against double precision and against every other instruction set of this machine, on
// bodies made to hurt: tails, clusters of one segment, 65 535 segments, full palettes.
#include <gtest/gtest.h>
#include <hwy/targets.h>
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
#include "tests/unit/runtime/reference_skinning.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
constexpr Skinning kEverySkinning[] = {Skinning::lbs, Skinning::dqs, Skinning::cor};

struct Shape {
  std::size_t nodes, segments, most_per_node, vertices;
};

// A cloud of nodes with random tets and weights: not a body, but all that the kernels see of one. Every third
// node has no centre; some vertices lie far outside of their tets.
Model cloud(const Shape& shape, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> mm(-400, 400), unit(0.05F, 1);
  std::uniform_int_distribution<std::size_t> segment(0, shape.segments - 1),
      count(1, std::min(shape.most_per_node, shape.segments)), node(0, shape.nodes - 1);
  Model model;
  model.name = "cloud";
  model.rig.skeleton.segments.resize(shape.segments);
  for (std::size_t s = 0; s < shape.segments; ++s) {
    model.rig.skeleton.segments[s].name = "s" + std::to_string(s);
  }
  const auto nodes = static_cast<Eigen::Index>(shape.nodes);
  model.nodes.resize(nodes, 3);
  model.cor.centre.resize(nodes, 3);
  model.weights.offsets = {0};
  for (Eigen::Index n = 0; n < nodes; ++n) {
    for (int c = 0; c < 3; ++c) model.nodes(n, c) = mm(random) + 900;
    model.cor.has_centre.push_back(n % 3 != 0);
    model.cor.centre.row(n) = model.nodes.row(n);
    if (n % 3 != 0) model.cor.centre.row(n) += Eigen::RowVector3f(30, -20, 10) * unit(random);
    std::vector<std::uint16_t> row(count(random));
    for (std::uint16_t& s : row) s = static_cast<std::uint16_t>(segment(random));
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    std::vector<float> weights(row.size());
    for (float& w : weights) w = unit(random);
    const float sum = std::accumulate(weights.begin(), weights.end(), 0.0F);
    for (std::size_t e = 0; e < row.size(); ++e) {
      model.weights.segment.push_back(row[e]);
      model.weights.weight.push_back(weights[e] / sum);
    }
    model.weights.offsets.push_back(model.weights.weight.size());
  }
  // As many tets as vertices, each of nodes of its own: palettes of 64 where there are enough nodes.
  model.tets.resize(static_cast<Eigen::Index>(shape.vertices), 4);
  Tissue tissue;
  tissue.name = "points";
  tissue.V.resize(model.tets.rows(), 3);
  tissue.barycentric.resize(model.tets.rows(), 4);
  tissue.F.resize(model.tets.rows() / 3, 3);
  for (Eigen::Index f = 0; f < tissue.F.rows(); ++f) {
    for (int c = 0; c < 3; ++c) tissue.F(f, c) = static_cast<int>(3 * f + c);
  }
  for (Eigen::Index v = 0; v < model.tets.rows(); ++v) {
    for (int c = 0; c < 4; ++c) model.tets(v, c) = static_cast<int>(node(random));
    const float far = v % 7 == 0 ? 1.5F : 0.2F;
    for (int c = 1; c < 4; ++c) tissue.barycentric(v, c) = far * unit(random);
    tissue.barycentric(v, 0) = 1 - tissue.barycentric.row(v).tail<3>().sum();
    tissue.V.row(v).setZero();
    for (int c = 0; c < 4; ++c) {
      tissue.V.row(v) += tissue.barycentric(v, c) * model.nodes.row(model.tets(v, c));
    }
    tissue.tet.push_back(static_cast<std::int32_t>(v));
  }
  model.tissues.push_back(tissue);
  return model;
}

// Segments that turn by up to `most` radians, signs as they come: nothing here is a tree.
std::vector<RigidTransform> random_segments(std::size_t count, double most, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> angle(-most, most);
  std::vector<RigidTransform> out(count);
  for (RigidTransform& motion : out) {
    const Vector3d axis = Vector3d(normal(random), normal(random), normal(random)).normalized();
    motion.q = Quaterniond(Eigen::AngleAxisd(angle(random), axis));
    motion.t = 200 * Vector3d(normal(random), normal(random), normal(random));
  }
  return out;
}

// The model's weights as the kernels have them, so that what is left is the kernels' own error.
Model as_kept(Model model) {
  for (std::size_t n = 0; n < model.node_count(); ++n) {
    const auto begin = model.weights.offsets[n], count = model.weights.offsets[n + 1] - begin;
    std::vector<double> row(count);
    std::vector<std::uint16_t> kept(count);
    double sum = 0;
    for (std::size_t e = 0; e < count; ++e) sum += static_cast<double>(model.weights.weight[begin + e]);
    for (std::size_t e = 0; e < count; ++e) {
      row[e] = static_cast<double>(model.weights.weight[begin + e]) / sum;
    }
    quantise_weights(row, kept);
    for (std::size_t e = 0; e < count; ++e) {
      model.weights.weight[begin + e] = static_cast<float>(kept[e] / 65535.0);
    }
  }
  return model;
}

PosedBody frame_of(const BodyParts& parts, const Model& model, const std::vector<RigidTransform>& segments) {
  PosedBody body;
  body.segments = segments;
  body.nodes.resize(3 * model.node_count());
  for (const Tissue& tissue : model.tissues) {
    body.tissues.emplace_back(static_cast<std::size_t>(tissue.V.size()));
    body.quantised.emplace_back(static_cast<std::size_t>(tissue.V.size()));
    body.normals.emplace_back(static_cast<std::size_t>(tissue.V.size()));
  }
  parts.make_scratch(body.scratch);
  body.scratch.motions.resize(segments.size());
  return body;
}

void pose(const BodyParts& parts, const Model& model, Skinning skinning, PosedBody& body,
          NodesOf nodes = NodesOf::body) {
  const std::vector<std::uint32_t> tissues{0};
  parts.pose(model, skinning, tissues, nodes, body);
}

std::size_t skinned(const PosedBody& body) {
  std::size_t clusters = 0;
  for (const std::uint64_t bits : body.scratch.mask)
    clusters += static_cast<std::size_t>(std::popcount(bits));
  return clusters;
}

// Calls `check` under each instruction set that this machine offers, the best one first.
template <class Check>
void for_instruction_sets(Check check) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    SCOPED_TRACE(hwy::TargetName(target));
    check();
  }
  hwy::SetSupportedTargetsForTest(0);
}

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
    for_instruction_sets([&] {
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
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    names += std::string(" ") + hwy::TargetName(target);
  }
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
    for_instruction_sets([&] {
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

TEST(Kernels, QuantisedPositionsAndNormals) {
  Model model = cloud({900, 6, 3, 200}, 12);
  const BodyParts parts(model);
  const auto segments = random_segments(6, 0.3, 13);
  for_instruction_sets([&] {
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
