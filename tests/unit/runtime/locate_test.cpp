// SPDX-License-Identifier: Apache-2.0
// Which tet holds a voxel's centre, against a search of all.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include <ecorche/runtime/resample.hpp>
#include "tests/support/toy_model.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/runtime/rest_nodes.hpp"
#include "tests/unit/runtime/skew_grids.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

// The slow, obvious search: every centre against every tet, by its four barycentric coordinates in LPS mm.
class Exhaustive {
 public:
  Exhaustive(const Model& model, const std::vector<float>& nodes) {
    for (std::int64_t t = 0; t < model.tets.rows(); ++t) {
      Eigen::Matrix4d corners;
      for (int c = 0; c < 4; ++c) corners.col(c) << node_of(model, nodes, t, c), 1;
      to_barycentric_.push_back(corners.fullPivLu().inverse());
      positive_.push_back(det_of(model, nodes, t) > 0);
    }
  }

  double smallest(std::size_t t, const Vector3d& p) const {
    return (to_barycentric_[t] * p.homogeneous()).minCoeff();
  }

  std::int32_t find(const Vector3d& p) const {
    for (const bool positive : {true, false}) {
      for (std::size_t t = 0; t < positive_.size(); ++t) {
        if (positive_[t] == positive && smallest(t, p) >= -1e-10) return static_cast<std::int32_t>(t);
      }
    }
    return InverseMap::none;
  }

 private:
  std::vector<Eigen::Matrix4d> to_barycentric_;
  std::vector<bool> positive_;
};

// Where a centre lies on a face up to rounding, any tet that touches it will do.
void expect_exhaustive(const Model& model, const std::vector<float>& nodes, const InverseMap& map) {
  const Exhaustive search(model, nodes);
  std::size_t held = 0;
  for (int k = 0; k < map.grid.size[2]; ++k) {
    for (int j = 0; j < map.grid.size[1]; ++j) {
      for (int i = 0; i < map.grid.size[0]; ++i) {
        const auto at = map.grid.point(i, j, k);
        const Vector3d p(at[0], at[1], at[2]);
        const std::int32_t found = map.tet[map.grid.offset(i, j, k)], expected = search.find(p);
        held += found != InverseMap::none;
        if (found == expected) continue;
        for (const std::int32_t t : {found, expected}) {
          if (t == InverseMap::none) continue;
          EXPECT_NEAR(search.smallest(static_cast<std::size_t>(t), p), 0, 1e-8) << i << " " << j << " " << k;
        }
      }
    }
  }
  EXPECT_GT(held, 100u);
}

TEST(Locate, AgreesWithAnExhaustiveSearch) {
  const Model model = test::toy_model();
  const auto rest = rest_nodes(model), bent = bent_nodes(model, 1.2, 0.8);
  InverseMap map;
  for (const bool left_handed : {false, true}) {
    for (const auto& nodes : {rest, bent}) {
      locate(model, nodes, skew_grid(left_handed), map);
      expect_exhaustive(model, nodes, map);
    }
  }
}

TEST(Locate, FoldsGoToPositiveTetsThenToTheLowestIndex) {
  const Model model = test::toy_model();
  const auto folded = bent_nodes(model, 2.4, 2.4);
  std::size_t inverted = 0;
  for (std::int64_t t = 0; t < model.tets.rows(); ++t) inverted += det_of(model, folded, t) < 0;
  ASSERT_GT(inverted, 5u) << "this pose was meant to fold";
  InverseMap map;
  locate(model, folded, skew_grid(false), map);
  expect_exhaustive(model, folded, map);
}

// Voxel centres that lie exactly on nodes, edges and faces of the mesh.
TEST(Locate, SharedFacesHoldEveryCentreOnce) {
  const Model model = test::toy_model();
  ImageGrid grid;
  grid.spacing = {5, 5, 5};  // nodes lie 20 x 20 x 16.67 mm apart; cells are cut along diagonals
  grid.size = {13, 13, 65};
  grid.origin = {-30, -30, -10};
  InverseMap map;
  locate(model, rest_nodes(model), grid, map);
  std::size_t expected = 0;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const auto p = grid.point(i, j, k);
        const bool inside = std::abs(p[0]) <= 20 && std::abs(p[1]) <= 20 && p[2] >= 0 && p[2] <= 300;
        expected += inside;
        EXPECT_EQ(map.tet[grid.offset(i, j, k)] != InverseMap::none, inside)
            << p[0] << " " << p[1] << " " << p[2];
      }
    }
  }
  EXPECT_EQ(expected, 9u * 9u * 61u);
  expect_exhaustive(model, rest_nodes(model), map);
}

TEST(Locate, FlatAndBrokenTetsHoldNothing) {
  const Model model = test::toy_model();
  InverseMap map;
  std::vector<float> flat = rest_nodes(model);
  for (std::size_t n = 0; n < flat.size(); n += 3) flat[n] = 0;
  locate(model, flat, skew_grid(false), map);
  EXPECT_EQ(std::count(map.tet.begin(), map.tet.end(), InverseMap::none),
            static_cast<std::ptrdiff_t>(map.tet.size()));
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 3e38F}) {
    std::vector<float> broken = rest_nodes(model);
    std::fill(broken.begin() + 30, broken.begin() + 60, bad);
    locate(model, broken, skew_grid(false), map);  // must neither crash nor hang
  }
}

TEST(Locate, SameForAnyNumberOfThreads) {
  const Model model = test::toy_model();
  const auto nodes = bent_nodes(model, 2.2, 1);
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 4);
  InverseMap one, four;
  tbb::task_arena(1).execute([&] { locate(model, nodes, skew_grid(false), one); });
  tbb::task_arena(4).execute([&] { locate(model, nodes, skew_grid(false), four); });
  EXPECT_EQ(one.tet, four.tet);
}

TEST(Locate, StopsWhenAsked) {
  const Model model = test::toy_model();
  std::stop_source source;
  source.request_stop();
  Context context;
  context.stop = source.get_token();
  InverseMap map;
  try {
    locate(model, rest_nodes(model), skew_grid(false), map, context);
    FAIL() << "must stop";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::interrupted);
  }
}

}  // namespace
}  // namespace ecorche::runtime
