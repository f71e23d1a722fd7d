// SPDX-License-Identifier: Apache-2.0
#include "preprocess/cor/centres.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <cstring>
#include <random>

#include "tests/unit/cor/brute_force.hpp"
#include "tests/unit/weights/box_mesh.hpp"

namespace ecorche::cor {
namespace {

/// Sparse rows from dense ones; entries below 1e-6 are cut and the row renormalised.
Weights sparse(const Eigen::MatrixXd& dense) {
  Weights w;
  w.offsets.push_back(0);
  for (Eigen::Index n = 0; n < dense.rows(); ++n) {
    const Eigen::VectorXd row = (dense.row(n).array() < 1e-6).select(0.0, dense.row(n));
    for (Eigen::Index s = 0; s < dense.cols(); ++s) {
      if (row(s) == 0) continue;
      w.segment.push_back(static_cast<std::uint16_t>(s));
      w.weight.push_back(static_cast<float>(row(s) / row.sum()));
    }
    w.offsets.push_back(w.segment.size());
  }
  return w;
}

/// Smooth weights like those of bones: shares of exp(-distance / reach) of points along z, pushed to 0 and 1.
Eigen::MatrixXd smooth_weights(const Points& V, int segments, double reach, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const Eigen::RowVector3d size = V.colwise().maxCoeff();
  Eigen::MatrixXd w(V.rows(), segments);
  for (int s = 0; s < segments; ++s) {
    const Eigen::RowVector3d at(size.x() * unit(random), size.y() * unit(random),
                                size.z() * (s + 0.5) / segments);
    for (Eigen::Index n = 0; n < V.rows(); ++n) w(n, s) = std::exp(-(V.row(n) - at).norm() / reach);
  }
  return w.array().colwise() / w.rowwise().sum().array();
}

struct Body {
  TetMesh mesh;
  PointsF nodes;
  Weights weights;
  std::size_t segments = 0;
};

Body beam(int segments, double reach, unsigned seed) {
  Body body;
  body.mesh = test::box_mesh({6, 6, 40}, 10);
  body.nodes = body.mesh.V.cast<float>();
  body.weights = sparse(smooth_weights(body.mesh.V, segments, reach, seed));
  body.segments = static_cast<std::size_t>(segments);
  return body;
}

/// Largest distance, mm, from the sums over all tets, over every `stride`-th node; both must agree on who has
/// a centre.
double worst_error(const Body& body, double sigma, std::size_t stride) {
  const CorCentres fast = centres(body.nodes, body.mesh.T, body.weights, body.segments, {sigma}, {});
  const test::BruteForce slow(body.nodes, body.mesh.T, body.weights, body.segments);
  double worst = 0;
  for (std::size_t n = 0; n < static_cast<std::size_t>(body.nodes.rows()); n += stride) {
    const auto expected = slow.centre(n, sigma);
    EXPECT_EQ(fast.has_centre[n] != 0, expected.alike > 1e-6 * expected.held) << "node " << n;
    if (!fast.has_centre[n]) continue;
    const Eigen::Vector3d got = fast.centre.row(static_cast<Eigen::Index>(n)).cast<double>().transpose();
    worst = std::max(worst, (got - expected.point).norm());
  }
  return worst;
}

// A body 400 mm high: the bound of the issue, 1e-4 of its height, is 0.04 mm.
class AgainstBruteForce : public testing::TestWithParam<std::tuple<int, double, double>> {};

TEST_P(AgainstBruteForce, WithinTenThousandthOfTheHeight) {
  const auto [segments, reach, sigma] = GetParam();
  const double worst = worst_error(beam(segments, reach, 11), sigma, 13);
  std::printf("  %d segments, reach %.0f mm, sigma %.3f: worst %.4f mm = %.1e of the height\n", segments,
              reach, sigma, worst, worst / 400);
  EXPECT_LT(worst, 0.04);
}

INSTANTIATE_TEST_SUITE_P(Beams, AgainstBruteForce,
                         testing::Combine(testing::Values(2, 3, 7), testing::Values(15.0, 60.0),
                                          testing::Values(0.05, 0.099)));

TEST(Centres, OfRandomWeightsAgreeToo) {
  // Nothing smooth about them: every node has its own random row, a third with two live segments, the rest
  // with more.
  Body body;
  body.mesh = test::box_mesh({8, 8, 8}, 50);
  body.nodes = body.mesh.V.cast<float>();
  body.segments = 5;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(body.mesh.V.rows(), 5);
  for (Eigen::Index n = 0; n < dense.rows(); ++n) {
    for (int s = 0; s < 5; ++s) dense(n, s) = n % 3 == 0 && s > 1 ? 0 : std::pow(unit(random), 4);
    dense.row(n) /= dense.row(n).sum();
  }
  body.weights = sparse(dense);
  for (const double sigma : {0.05, 0.099}) EXPECT_LT(worst_error(body, sigma, 7), 0.04) << sigma;
}

TEST(Centres, LieOnThePlaneOfSymmetry) {
  // Two segments, weights mirrored about z = 100. The mesh is its own image under reflection in the middle
  // point, so centres of opposite nodes are opposite, and a node in the plane turns about a point of the
  // plane, on the beam's axis but for what the diagonals of the cubes add.
  Body body;
  body.mesh = test::box_mesh({4, 4, 20}, 10);
  body.nodes = body.mesh.V.cast<float>();
  body.segments = 2;
  Eigen::MatrixXd dense(body.mesh.V.rows(), 2);
  for (Eigen::Index n = 0; n < dense.rows(); ++n) {
    dense(n, 0) = 1 / (1 + std::exp((body.mesh.V(n, 2) - 100) / 15));
    dense(n, 1) = 1 - dense(n, 0);
  }
  body.weights = sparse(dense);
  const CorCentres result = centres(body.nodes, body.mesh.T, body.weights, 2, {0.05}, {});
  for (Eigen::Index n = 0; n < dense.rows(); ++n) {
    ASSERT_TRUE(result.has_centre[static_cast<std::size_t>(n)]);
    EXPECT_NEAR(result.centre(n, 0), 20, 0.1);
    EXPECT_NEAR(result.centre(n, 1), 20, 0.1);
    if (body.mesh.V(n, 2) == 100) {
      EXPECT_NEAR(result.centre(n, 2), 100, 1e-3);
    }
    const Eigen::RowVector3f opposite = result.centre.row(dense.rows() - 1 - n);
    const Eigen::RowVector3f sum = result.centre.row(n) + opposite;
    EXPECT_LT((sum - Eigen::RowVector3f(40, 40, 200)).norm(), 2e-3F);
  }
}

TEST(Centres, ANodeOfOneSegmentHasNone) {
  Body body = beam(3, 15, 2);
  Eigen::MatrixXd dense = smooth_weights(body.mesh.V, 3, 15, 2);
  dense.row(17) << 0, 1, 0;
  body.weights = sparse(dense);
  const CorCentres result = centres(body.nodes, body.mesh.T, body.weights, 3, {0.05}, {});
  EXPECT_EQ(result.has_centre[17], 0);
  EXPECT_EQ(result.centre.row(17), body.nodes.row(17));
  EXPECT_EQ(result.has_centre[18], 1);
  EXPECT_EQ(result.sigma, 0.05);
}

TEST(Centres, ANodeThatNothingResemblesHasNone) {
  // One tet of two far from each other: node 0 is half and half, all four tets around are 9 : 1 or less
  // alike.
  PointsF nodes(8, 3);
  nodes << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 10, 0, 0, 11, 0, 0, 10, 1, 0, 10, 0, 1;
  Tets tets(2, 4);
  tets << 0, 1, 2, 3, 4, 5, 6, 7;
  Eigen::MatrixXd dense(8, 2);
  dense << 0.5, 0.5, 1, 0, 1, 0, 1, 0, 0.9, 0.1, 0.9, 0.1, 0.9, 0.1, 0.9, 0.1;
  // The tet of node 0 is (0.875, 0.125) on the average, the other (0.9, 0.1): from (0.5, 0.5) the cross
  // products are 0.375 and 0.4, at least 7.5 sigma.
  const CorCentres result = centres(nodes, tets, sparse(dense), 2, {0.05}, {});
  EXPECT_EQ(result.has_centre[0], 0);
  EXPECT_EQ(result.centre.row(0), nodes.row(0));
  EXPECT_EQ(result.has_centre[1], 0);  // one segment
  EXPECT_EQ(result.has_centre[4], 1);
}

TEST(Centres, AreFiniteAndInsideTheBox) {
  for (const double reach : {3.0, 15.0, 200.0}) {
    const Body body = beam(6, reach, 23);
    const CorCentres result = centres(body.nodes, body.mesh.T, body.weights, 6, {0.05}, {});
    ASSERT_TRUE(result.centre.allFinite());
    EXPECT_GE(result.centre.minCoeff(), -0.1F);
    EXPECT_LE((result.centre.colwise().maxCoeff() - body.nodes.colwise().maxCoeff()).maxCoeff(), 0.1F);
  }
}

TEST(Centres, AreTheSameBytesForOneAndTwoThreads) {
  const Body body = beam(7, 40, 3);
  const auto with = [&](int threads) {
    tbb::task_arena arena(threads);
    return arena.execute([&] { return centres(body.nodes, body.mesh.T, body.weights, 7, {0.07}, {}); });
  };
  const CorCentres one = with(1), two = with(2);
  ASSERT_EQ(one.centre.size(), two.centre.size());
  EXPECT_EQ(
      std::memcmp(one.centre.data(), two.centre.data(), static_cast<std::size_t>(one.centre.size()) * 4), 0);
  EXPECT_EQ(one.has_centre, two.has_centre);
}

TEST(Centres, RefuseASigmaOutOfRange) {
  const Body body = beam(2, 15, 1);
  for (const double sigma : {0.0, -1.0, 0.1, std::nan("")}) {
    try {
      centres(body.nodes, body.mesh.T, body.weights, 2, {sigma}, {});
      FAIL() << sigma;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      EXPECT_EQ(error.mend(), "give a number between 0 and 0.1");
    }
  }
}

TEST(Centres, StopWhenAsked) {
  const Body body = beam(3, 15, 1);
  std::stop_source source;
  source.request_stop();
  Context context;
  context.stop = source.get_token();
  EXPECT_THROW(centres(body.nodes, body.mesh.T, body.weights, 3, {0.05}, context), Error);
}

}  // namespace
}  // namespace ecorche::cor
