// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/bind.hpp"
#include "tests/unit/io/scratch.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <random>

#include "tests/support/triangle_distance.hpp"
#include "tests/unit/mapping/exhaustive.hpp"
#include "tests/unit/mapping/lattices.hpp"

namespace ecorche::mapping {
namespace {

using test::FloatTets;

// Points everywhere: around the mesh and in its slot, on nodes, on edges, on faces shared and not.
Points probes(const FloatTets& mesh, int count) {
  std::mt19937 random(23);
  std::uniform_real_distribution<double> unit(0, 1);
  const Eigen::RowVector3d low = mesh.nodes.colwise().minCoeff().cast<double>();
  const Eigen::RowVector3d size = mesh.nodes.colwise().maxCoeff().cast<double>() - low;
  Points points(count, 3);
  for (int i = 0; i < count; ++i) {
    const auto tet = static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(mesh.tets.rows()));
    const auto corner = [&](int c) -> Eigen::RowVector3d {
      return test::node(mesh.nodes, mesh.tets(tet, c)).transpose();
    };
    switch (i % 6) {
      case 0:
        points.row(i) = corner(0);
        break;
      case 1:
        points.row(i) = (corner(1) + corner(2)) / 2;
        break;
      case 2:
        points.row(i) = (corner(1) + corner(2) + corner(3)) / 3;
        break;
      default:
        for (int axis = 0; axis < 3; ++axis)
          points(i, axis) = low[axis] + size[axis] * (1.6 * unit(random) - 0.3);
    }
  }
  return points.cast<float>().cast<double>();  // tissues are stored in float32
}

void expect_equal_to_exhaustive(const FloatTets& mesh, const Points& points) {
  const Binding binding = Locator(mesh.nodes, mesh.tets).bind(points, {});
  const auto outer = test::outer_faces(mesh.tets);
  std::uint64_t outside = 0;
  double farthest = 0;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const auto p = static_cast<std::size_t>(i);
    const Eigen::Vector3d x = points.row(i).transpose();
    const std::int32_t holder = test::first_holder(mesh.nodes, mesh.tets, x);
    const std::int32_t bound = binding.tet[p];
    if (holder >= 0) {
      // The same, or one that holds it as well to rounding.
      if (bound != holder) {
        EXPECT_NEAR(test::least_coordinate(mesh.nodes, mesh.tets, bound, x), 0, 1e-8);
      }
      EXPECT_EQ(binding.outside_mm[p], 0);
      continue;
    }
    ++outside;
    double least = 1e300, of_bound = 1e300;
    for (const auto& [face, tet] : outer) {
      const double d =
          test::triangle_distance(x, test::node(mesh.nodes, face[0]), test::node(mesh.nodes, face[1]),
                                  test::node(mesh.nodes, face[2]));
      least = std::min(least, d);
      if (tet == bound) of_bound = std::min(of_bound, d);
    }
    ASSERT_NEAR(of_bound, least, 1e-9) << "point " << i;
    EXPECT_NEAR(binding.outside_mm[p], least, 1e-5);
    farthest = std::max(farthest, least);
  }
  EXPECT_EQ(binding.outside, outside);
  EXPECT_NEAR(binding.max_outside_mm, farthest, 1e-5);
  EXPECT_GT(outside, 0U);
}

TEST(Bind, equals_an_exhaustive_search_on_a_letter_c) {
  const FloatTets mesh = test::letter_c();
  expect_equal_to_exhaustive(mesh, probes(mesh, 4000));
}

TEST(Bind, equals_an_exhaustive_search_on_a_regular_lattice) {
  const FloatTets mesh = test::letter_c({-8, 4, 0}, 0);  // every tie there is
  expect_equal_to_exhaustive(mesh, probes(mesh, 3000));
}

TEST(Bind, equals_an_exhaustive_search_on_scattered_cubes) {
  const FloatTets mesh = test::block(6, {100, -200, 300}, 0.5,
                                     [](int i, int j, int k) { return (7 * i + 5 * j + 3 * k) % 4 == 0; });
  expect_equal_to_exhaustive(mesh, probes(mesh, 3000));
}

TEST(Bind, a_node_belongs_to_the_lowest_tet_around_it) {
  const FloatTets mesh = test::letter_c();
  const Binding binding = Locator(mesh.nodes, mesh.tets).bind(mesh.nodes.cast<double>(), {});
  std::vector<std::int32_t> lowest(static_cast<std::size_t>(mesh.nodes.rows()), -1);
  for (std::int32_t t = static_cast<std::int32_t>(mesh.tets.rows()) - 1; t >= 0; --t) {
    for (int c = 0; c < 4; ++c) lowest[static_cast<std::size_t>(mesh.tets(t, c))] = t;
  }
  EXPECT_EQ(binding.tet, lowest);
  EXPECT_EQ(binding.outside, 0U);
}

TEST(Bind, the_corners_of_the_box_are_inside) {
  const FloatTets mesh = test::block(3, {0, 0, 0}, 0, [](int, int, int) { return true; });
  EXPECT_EQ(Locator(mesh.nodes, mesh.tets).bind(mesh.nodes.cast<double>(), {}).outside, 0U);
}

TEST(Bind, where_tets_overlap_the_lowest_holds) {
  FloatTets mesh{PointsF(12, 3), Tets(3, 4)};  // the first is inverted: it holds nothing
  for (int t = 0; t < 3; ++t) {
    mesh.nodes.middleRows(4 * t, 4) << 0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 4;
    mesh.tets.row(t) << 4 * t, 4 * t + 1, 4 * t + 2, 4 * t + 3;
  }
  std::swap(mesh.tets(0, 0), mesh.tets(0, 1));
  mesh.nodes.bottomRows(4).array() += 1;
  Points points(3, 3);
  points << 1.1, 1.1, 1.1, 0.5, 0.5, 0.5, 1.5, 1.5, 1.5;
  const Binding binding = Locator(mesh.nodes, mesh.tets).bind(points, {});
  EXPECT_EQ(binding.tet, (std::vector<std::int32_t>{1, 1, 2}));
}

TEST(Bind, rest_comes_back_in_float_two_metres_from_the_origin) {
  const FloatTets mesh = test::letter_c({1990, -2000, 1985});
  const Points points = probes(mesh, 6000);
  const Binding binding = Locator(mesh.nodes, mesh.tets).bind(points, {});
  double worst = 0, worst_sum = 0;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const Eigen::RowVector4f bary = binding.barycentric.row(i);
    const auto back = test::rebuilt(mesh.nodes, mesh.tets, binding.tet[static_cast<std::size_t>(i)], bary);
    worst = std::max(worst, (back.cast<double>() - points.row(i)).norm());
    worst_sum = std::max(worst_sum, std::abs(bary.cast<double>().sum() - 1));
    EXPECT_EQ(bary[0], static_cast<float>(1.0 - (double{bary[1]} + double{bary[2]} + double{bary[3]})));
  }
  EXPECT_LT(worst, 1e-3);
  EXPECT_LT(worst_sum, 1e-6);
}

TEST(Bind, signed_coordinates_continue_the_tets_map) {
  FloatTets one{PointsF(4, 3), Tets(1, 4)};
  one.nodes << 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 2;
  one.tets << 0, 1, 2, 3;
  Points p(1, 3);
  p << -1, 0.5, 0.25;
  const Binding binding = Locator(one.nodes, one.tets).bind(p, {});
  EXPECT_EQ(binding.barycentric.row(0), Eigen::RowVector4f(1.125F, -0.5F, 0.25F, 0.125F));
  EXPECT_EQ(binding.outside, 1U);
  EXPECT_DOUBLE_EQ(binding.max_outside_mm, 1);
}

TEST(Bind, threads_change_nothing) {
  const FloatTets mesh = test::letter_c();
  const Points points = probes(mesh, 20000);
  std::vector<Binding> made;
  for (const std::size_t threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    made.push_back(Locator(mesh.nodes, mesh.tets).bind(points, {}));
  }
  EXPECT_EQ(made[0].tet, made[1].tet);
  EXPECT_EQ(made[0].barycentric, made[1].barycentric);
  EXPECT_EQ(made[0].outside_mm, made[1].outside_mm);
}

TEST(Bind, refusals) {
  const FloatTets mesh = test::letter_c();
  expect_error(ErrorKind::data, "mapping: the mesh has no tets (try another mesher)",
               [&] { Locator(mesh.nodes, Tets(0, 4)); });
  const Locator locator(mesh.nodes, mesh.tets);
  EXPECT_THROW(locator.bind(Points::Constant(1, 3, std::nan("")), {}), Error);
  EXPECT_EQ(locator.bind(Points(0, 3), {}).outside, 0U);
  std::stop_source stop;
  stop.request_stop();
  Context context;
  context.stop = stop.get_token();
  EXPECT_THROW(locator.bind(Points::Zero(10, 3), context), Error);
}

}  // namespace
}  // namespace ecorche::mapping
