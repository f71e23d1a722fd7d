// SPDX-License-Identifier: Apache-2.0
// Clusters of nodes and groups of vertices, made by many threads, digits and vectors, against the obvious
// way: the same numbers, to the last bit.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <tuple>

#include "runtime/skin/group_cells.hpp"
#include "runtime/skin/vertex_groups.hpp"
#include "tests/unit/runtime/clouds.hpp"

namespace ecorche::runtime {
namespace {

constexpr std::size_t kGroup = VertexGroups::size, kCluster = NodeClusters::size;

// What is kept of a node's weights, in whole 65535ths: the largest remainders are rounded up.
std::map<std::uint16_t, int> kept_weights(const Model& model, std::size_t node) {
  std::vector<std::pair<std::uint16_t, double>> kept;
  double sum = 0;
  for (auto e = model.weights.offsets[node]; e < model.weights.offsets[node + 1]; ++e) {
    if (model.weights.weight[e] < 1e-4F) continue;
    kept.emplace_back(model.weights.segment[e], static_cast<double>(model.weights.weight[e]));
    sum += kept.back().second;
  }
  std::map<std::uint16_t, int> out;
  std::vector<std::tuple<double, std::uint16_t>> left;  // remainders, the largest first
  int whole = 65535;
  for (const auto& [segment, weight] : kept) {
    const double exact = weight / sum * 65535;
    out[segment] = static_cast<int>(std::floor(exact));
    whole -= out[segment];
    left.emplace_back(std::floor(exact) - exact, segment);
  }
  std::sort(left.begin(), left.end());
  for (std::size_t i = 0; i < static_cast<std::size_t>(whole); ++i) ++out[std::get<1>(left[i])];
  return out;
}

void expect_clusters(const Model& model, const NodeClusters& clusters) {
  ASSERT_EQ(clusters.begin.size(), clusters.clusters() + 1);
  for (std::size_t c = 0; c < clusters.clusters(); ++c) {
    std::set<std::uint16_t> segments;
    for (std::size_t i = 0; i < kCluster; ++i) {
      for (const auto& [segment, weight] : kept_weights(model, clusters.node[kCluster * c + i]))
        segments.insert(segment);
    }
    const auto from = clusters.palette.begin() + clusters.begin[c],
               to = clusters.palette.begin() + clusters.begin[c + 1];
    ASSERT_EQ(std::vector(from, to), std::vector(segments.begin(), segments.end())) << c;
    for (std::size_t i = 0; i < kCluster; ++i) {
      const std::uint32_t node = clusters.node[kCluster * c + i];
      const auto kept = kept_weights(model, node);
      for (std::uint32_t p = clusters.begin[c]; p < clusters.begin[c + 1]; ++p) {
        const auto found = kept.find(clusters.palette[p]);
        ASSERT_EQ(clusters.weight[kCluster * p + i], found == kept.end() ? 0 : found->second) << node;
      }
      const PointsF& centres = model.cor.has_centre[node] != 0 ? model.cor.centre : model.nodes;
      for (int k = 0; k < 3; ++k) {
        const std::size_t at = kCluster * (3 * c + static_cast<std::size_t>(k)) + i;
        ASSERT_EQ(clusters.rest[at], model.nodes(node, k));
        ASSERT_EQ(clusters.centre[at], centres(node, k));
      }
    }
  }
}

// As NodeClusters says it.
std::vector<std::uint32_t> lanes_in_order(const Model& model, const std::vector<std::uint32_t>& kind) {
  const auto segments = [&](std::uint32_t node) {
    std::uint64_t bits = 0;
    for (const auto& [segment, weight] : kept_weights(model, node)) bits |= std::uint64_t{1} << segment % 64;
    return bits;
  };
  std::vector<std::uint32_t> out;
  for (const bool wanted : {true, false}) {
    std::vector<std::uint32_t> nodes;
    for (std::uint32_t n = 0; n < kind.size(); ++n)
      if ((kind[n] != 0) == wanted) nodes.push_back(n);
    if (wanted && !nodes.empty()) {
      PointsF places(static_cast<Eigen::Index>(nodes.size()), 3);
      for (std::size_t i = 0; i < nodes.size(); ++i)
        places.row(static_cast<Eigen::Index>(i)) = model.nodes.row(nodes[i]);
      const Eigen::RowVector3f low = places.colwise().minCoeff();
      Eigen::Index axis = 0;
      const float length = (Eigen::RowVector3f(places.colwise().maxCoeff()) - low).maxCoeff(&axis);
      std::stable_sort(nodes.begin(), nodes.end(), [&](auto a, auto b) {
        const auto place = [&](auto n) {
          return static_cast<int>((model.nodes(n, axis) - low[axis]) / length * 65535);
        };
        return place(a) < place(b);
      });
    }
    const std::size_t run = wanted ? NodeClusters::slab : 2048;
    for (std::size_t first = 0; first < nodes.size(); first += run) {
      std::sort(nodes.begin() + static_cast<std::ptrdiff_t>(first),
                nodes.begin() + static_cast<std::ptrdiff_t>(std::min(nodes.size(), first + run)),
                [&](auto a, auto b) {
                  return std::tuple(segments(a), kind[a], a) < std::tuple(segments(b), kind[b], b);
                });
    }
    out.insert(out.end(), nodes.begin(), nodes.end());
  }
  return out;
}

TEST(BodyLayout, ClustersHoldWhatTheirNodesHave) {
  const tbb::global_control many(tbb::global_control::max_allowed_parallelism, 4);
  for (const std::size_t segments : {std::size_t{9}, std::size_t{150}}) {
    Model model = cloud({21'000, segments, 6, 10}, 21);
    model.weights.weight[3] = 1e-5F;  // too little to be kept
    std::vector<std::uint32_t> kind(model.node_count());
    std::mt19937 random(22);
    for (std::uint32_t& k : kind) k = random() % 3;
    for (const int threads : {1, 4}) {
      NodeClusters clusters;
      tbb::task_arena(threads).execute([&] { clusters = cluster_nodes(model, kind); });
      EXPECT_EQ(std::vector(clusters.node.begin(), clusters.node.begin() + 21'000),
                lanes_in_order(model, kind));
      expect_clusters(model, clusters);
    }
  }
}

TEST(BodyLayout, TheFirstNodeWithoutAWeightIsNamed) {
  Model model = cloud({30'000, 5, 3, 10}, 23);
  for (const std::size_t node : {29'000U, 17'001U, 12'000U}) {
    for (auto e = model.weights.offsets[node]; e < model.weights.offsets[node + 1]; ++e)
      model.weights.weight[e] = 0;
  }
  try {
    cluster_nodes(model, std::vector<std::uint32_t>(model.node_count(), 0));
    ADD_FAILURE() << "nobody missed the weight";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("node 12000 "), std::string::npos) << error.what();
  }
}

// 1/8 mm from the lowest corner, bit by bit.
std::vector<std::uint32_t> along_morton(const PointsF& V) {
  const Eigen::RowVector3f low = V.colwise().minCoeff();
  std::vector<std::pair<std::uint64_t, std::uint32_t>> code;
  for (Eigen::Index v = 0; v < V.rows(); ++v) {
    std::uint64_t bits = 0;
    for (unsigned c = 0; c < 3; ++c) {
      const auto at = static_cast<std::uint64_t>((V(v, c) - low[c]) * 8);
      for (unsigned b = 0; b < 21; ++b) bits |= (at >> b & 1) << (3 * b + c);
    }
    code.emplace_back(bits, static_cast<std::uint32_t>(v));
  }
  std::sort(code.begin(), code.end());
  std::vector<std::uint32_t> out;
  out.reserve(code.size());
  for (const auto& [bits, v] : code) out.push_back(v);
  return out;
}

Eigen::Matrix3f edges_of(const Model& model, std::int32_t tet) {
  Eigen::Matrix3f out;
  for (int c = 0; c < 3; ++c)
    out.col(c) = (model.nodes.row(model.tets(tet, c + 1)) - model.nodes.row(model.tets(tet, 0))).transpose();
  return out;
}

// One group at a time, each vertex by itself.
void expect_group(const Model& model, const Tissue& tissue, const PointsF& normals,
                  const std::vector<std::uint32_t>& vertices, const VertexGroups& groups, std::size_t g,
                  const VertexGroups::Cell& cell) {
  const VertexGroups::Group& group = groups.groups[g];
  float low = 0, high = 0, reach = 0;
  for (const std::uint32_t v : vertices) {
    for (int c = 1; c < 4; ++c) {
      low = std::min(low, tissue.barycentric(v, c));
      high = std::max(high, tissue.barycentric(v, c));
    }
    reach = std::max(reach, edges_of(model, tissue.tet[v]).colwise().norm().sum());
  }
  const float step = (high - low) / 65535;
  const bool narrow = step > 0 && step / 2 * reach <= 2e-4F;
  ASSERT_EQ(group.low, low);
  ASSERT_EQ(group.step, narrow ? step : 0);
  for (std::size_t i = 0; i < kGroup; ++i) {
    const std::uint32_t v = vertices[std::min(i, vertices.size() - 1)];
    const Eigen::Vector3f shares = normal_shares(edges_of(model, tissue.tet[v]), normals.row(v).transpose());
    Eigen::Index first = 0;
    std::array<int, 3> corner{1, 2, 3};
    std::array<int, 2> normal{VertexGroups::no_normal, 0};
    if (shares.cwiseAbs().maxCoeff(&first) > 0) {
      Eigen::Index second = (first + 1) % 3, third = (first + 2) % 3;
      if (shares[first] < 0) std::swap(second, third);
      corner = {static_cast<int>(first) + 1, static_cast<int>(second) + 1, static_cast<int>(third) + 1};
      normal = {static_cast<int>(std::lround(32767 * shares[second] / shares[first])),
                static_cast<int>(std::lround(32767 * shares[third] / shares[first]))};
    }
    ASSERT_EQ(groups.normal[2 * kGroup * g + i], normal[0]) << v;
    ASSERT_EQ(groups.normal[2 * kGroup * g + kGroup + i], normal[1]) << v;
    const auto node_at = [&](unsigned k) {
      return groups.rows[cell.palette + (groups.corners[kGroup * g + i] >> 8 * k & 255U)] / 3;
    };
    ASSERT_EQ(static_cast<int>(node_at(0)), model.tets(tissue.tet[v], 0));
    for (unsigned c = 0; c < 3; ++c) {
      ASSERT_EQ(static_cast<int>(node_at(c + 1)), model.tets(tissue.tet[v], corner[c]));
      const float b = tissue.barycentric(v, corner[c]);
      if (narrow) {
        ASSERT_EQ(static_cast<float>(groups.narrow[group.data + kGroup * c + i]),
                  std::round((b - low) / step));
      } else {
        ASSERT_EQ(groups.wide[group.data + kGroup * c + i], b);
      }
    }
  }
}

// Lanes are nodes.
void expect_groups(const Model& model, const Tissue& tissue, bool in_order, bool some_narrow) {
  std::vector<std::uint32_t> lane(model.node_count()), order(static_cast<std::size_t>(tissue.V.rows()));
  std::iota(lane.begin(), lane.end(), 0U);
  std::iota(order.begin(), order.end(), 0U);
  if (!in_order) order = along_morton(tissue.V);
  const VertexGroups groups = group_vertices(model, tissue, NodesOfTissues(model).of(tissue), lane);
  ASSERT_EQ(groups.in_order, in_order);
  EXPECT_EQ(!groups.narrow.empty(), some_narrow);
  const auto vertices_of = [&](std::size_t g) {
    const auto from = order.begin() + static_cast<std::ptrdiff_t>(kGroup * g);
    return std::vector(from, from + static_cast<std::ptrdiff_t>(std::min(kGroup, order.size() - kGroup * g)));
  };
  const auto nodes_of_group = [&](std::size_t g) {
    std::set<std::uint32_t> out;
    for (const std::uint32_t v : vertices_of(g))
      for (int c = 0; c < 4; ++c) out.insert(static_cast<std::uint32_t>(model.tets(tissue.tet[v], c)));
    return out;
  };
  GroupNodes nodes;
  for (std::size_t g = 0; kGroup * g < order.size(); ++g) {
    const std::set<std::uint32_t> of_group = nodes_of_group(g);
    nodes.node.insert(nodes.node.end(), of_group.begin(), of_group.end());
    nodes.begin.push_back(static_cast<std::uint32_t>(nodes.node.size()));
  }
  const GroupCells cells = share_palettes(nodes, VertexGroups::most_lanes, VertexGroups::most_groups);
  std::vector<std::pair<std::size_t, std::vector<std::uint32_t>>> by_slab;  // of the last node
  for (std::size_t c = 0, g = 0; c < cells.end.size(); ++c) {
    auto& [slab, of_cell] = by_slab.emplace_back();
    for (; g < cells.end[c]; ++g) {
      of_cell.push_back(cells.group[g]);
      slab = std::max<std::size_t>(slab, *nodes_of_group(cells.group[g]).rbegin() / NodeClusters::slab);
    }
  }
  std::stable_sort(by_slab.begin(), by_slab.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  const PointsF normals = rest_normals(tissue);
  ASSERT_EQ(groups.cells.size(), by_slab.size());
  std::size_t g = 0;
  for (std::size_t c = 0; c < by_slab.size(); ++c) {
    const VertexGroups::Cell& cell = groups.cells[c];
    std::set<std::uint32_t> palette;
    for (const std::uint32_t group : by_slab[c].second) palette.merge(nodes_of_group(group));
    std::vector<std::uint32_t> rows(palette.begin(), palette.end());
    rows.resize((rows.size() + kGroup - 1) / kGroup * kGroup, rows.back());
    for (std::uint32_t& row : rows) row *= 3;
    const auto from = groups.rows.begin() + cell.palette;
    ASSERT_EQ(std::vector<std::uint32_t>(from, from + cell.count), rows) << c;
    for (const std::uint32_t group : by_slab[c].second) {
      ASSERT_EQ(groups.groups[g].first, kGroup * group);
      expect_group(model, tissue, normals, vertices_of(group), groups, g++, cell);
    }
    ASSERT_EQ(cell.end, g);
  }
  if (!in_order) {
    order.resize(kGroup * groups.groups.size(), order.back());
    EXPECT_EQ(groups.vertex, order);
  }
}

// Tets as wide as the cloud need wide numbers, and those of a body narrow ones.
TEST(BodyLayout, GroupsHoldWhatTheirVerticesHave) {
  for (const float size : {1.0F, 0.01F}) {
    for (const std::size_t nodes : {300U, 20'000U}) {
      Model model = cloud({nodes, 3, 2, 2'005}, 24);
      model.nodes *= size;
      model.tissues[0].V *= size;
      model.tissues[0].F.conservativeResize(600, 3);  // the last vertices have no normal
      expect_groups(model, model.tissues[0], true, size < 1);
    }
  }
}

// Vertices that hang on few tets, as a shuffle leaves them.
TEST(BodyLayout, WhatIsNotLocalIsOrderedAlongMorton) {
  Model model = cloud({4'000, 3, 2, 1'000}, 25);
  model.nodes *= 0.01F;
  Tissue tissue = model.tissues[0];
  const Eigen::Index copies = 16;
  tissue.V.resize(copies * 1'000, 3);
  tissue.barycentric.resize(copies * 1'000, 4);
  tissue.F.resize(0, 3);
  std::vector<std::int32_t> tet;
  for (Eigen::Index v = 0; v < tissue.V.rows(); ++v) {
    tet.push_back(static_cast<std::int32_t>(v % 1'000));
    tissue.barycentric.row(v) << 0.25F, 0.25F, 0.25F, 0.25F;
    tissue.V.row(v) << static_cast<float>(v % 10), static_cast<float>(v / 10 % 10),
        static_cast<float>(v / 100 % 10);
  }
  tissue.tet = tet;
  expect_groups(model, tissue, false, true);
}

}  // namespace
}  // namespace ecorche::runtime
