// SPDX-License-Identifier: Apache-2.0
// Centres of rotation of a whole body against the sums over all its tets, on nodes drawn by a fixed seed.
// Reads ECORCHE_MODEL: the small phantom's model under ctest, any model by hand.
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include <ecorche/model_file/model_file.hpp>
#include "preprocess/cor/centres.hpp"
#include "tests/unit/cor/brute_force.hpp"

namespace ecorche::cor {
namespace {

constexpr std::size_t kDrawn = 1000;
constexpr float kLive = 0.01F;  ///< a segment that moves a node visibly

using Strata = std::map<std::pair<int, int>, std::vector<std::size_t>>;

/// Nodes by their two heaviest segments; `three` asks for nodes with a third live segment, else for those
/// without.
Strata strata(const Weights& w, bool three) {
  Strata result;
  for (std::size_t n = 0; n + 1 < w.offsets.size(); ++n) {
    std::vector<std::pair<float, int>> row;
    for (auto e = w.offsets[n]; e < w.offsets[n + 1]; ++e) row.emplace_back(w.weight[e], w.segment[e]);
    if (row.size() < 2) continue;
    std::sort(row.rbegin(), row.rend());
    const bool has_three = row.size() > 2 && row[2].first >= kLive;
    if (has_three == three) result[std::minmax(row[0].second, row[1].second)].push_back(n);
  }
  return result;
}

/// `count` nodes, one from each stratum in turn.
void draw(Strata all, std::size_t count, std::mt19937& random, std::vector<std::size_t>& drawn) {
  for (auto& [pair, nodes] : all) std::shuffle(nodes.begin(), nodes.end(), random);
  const std::size_t until = drawn.size() + count;
  for (bool any = true; any && drawn.size() < until;) {
    any = false;
    for (auto& [pair, nodes] : all) {
      if (nodes.empty() || drawn.size() == until) continue;
      drawn.push_back(nodes.back());
      nodes.pop_back();
      any = true;
    }
  }
}

class Body : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const char* path = std::getenv("ECORCHE_MODEL");
    if (path == nullptr) return;
    model = new Model(model_file::read(path, {}));
    std::printf("  %s: %zu nodes, %zu tets, %zu segments\n", path, model->node_count(), model->tet_count(),
                model->segment_count());
  }
  static void TearDownTestSuite() { delete std::exchange(model, nullptr); }
  void SetUp() override { ASSERT_NE(model, nullptr) << "set ECORCHE_MODEL"; }
  static Model* model;
};
Model* Body::model = nullptr;

TEST_F(Body, CentresAgreeWithTheSumOverAllTets) {
  const std::size_t segments = model->segment_count();
  const double height =
      static_cast<double>((model->nodes.colwise().maxCoeff() - model->nodes.colwise().minCoeff()).maxCoeff());
  std::mt19937 random(2018);
  std::vector<std::size_t> nodes;
  const Strata three = strata(model->weights, true), two = strata(model->weights, false);
  draw(three, kDrawn / 3, random, nodes);
  const std::size_t with_three = nodes.size();
  draw(two, kDrawn - nodes.size(), random, nodes);
  std::printf("  %zu nodes of %zu pairs, %zu of them with three or more segments; body height %.0f mm\n",
              nodes.size(), three.size() + two.size(), with_three, height);
  ASSERT_EQ(nodes.size(), kDrawn);
  EXPECT_GE(with_three, kDrawn / 3);

  const test::BruteForce brute(model->nodes, model->tets, model->weights, segments);
  std::printf("  sigma   worst mm  of height  p95 mm   median mm  without centre\n");
  for (const double sigma : {0.05, 0.099}) {
    const CorCentres fast = centres(model->nodes, model->tets, model->weights, segments, {sigma}, {});
    std::vector<double> error(nodes.size(), 0);
    std::vector<std::uint8_t> disagree(nodes.size(), 0);
    tbb::parallel_for(std::size_t{0}, nodes.size(), [&](std::size_t i) {
      const auto slow = brute.centre(nodes[i], sigma);
      const double share = slow.alike / slow.held;
      const bool has = fast.has_centre[nodes[i]] != 0;
      // The rule's edge is as sharp as the tables are there: a factor of two.
      disagree[i] = has ? share < 0.5e-6 : share > 2e-6;
      const auto row = static_cast<Eigen::Index>(nodes[i]);
      if (has) error[i] = (fast.centre.row(row).cast<double>().transpose() - slow.point).norm();
    });
    EXPECT_EQ(std::count(disagree.begin(), disagree.end(), 1), 0);
    const auto without =
        std::count_if(nodes.begin(), nodes.end(), [&](std::size_t n) { return !fast.has_centre[n]; });
    std::sort(error.begin(), error.end());
    std::printf("  %.3f  %9.4f  %9.1e  %7.4f  %9.4f  %ld\n", sigma, error.back(), error.back() / height,
                error[error.size() * 95 / 100], error[error.size() / 2], static_cast<long>(without));
    EXPECT_LE(error.back(), 1e-4 * height);
    EXPECT_TRUE(fast.centre.allFinite());
  }
}

TEST_F(Body, StoredCentresAreTheseCentres) {
  const CorCentres again =
      centres(model->nodes, model->tets, model->weights, model->segment_count(), {model->cor.sigma}, {});
  EXPECT_EQ(again.centre, model->cor.centre);
  EXPECT_EQ(again.has_centre, model->cor.has_centre);
}

}  // namespace
}  // namespace ecorche::cor
