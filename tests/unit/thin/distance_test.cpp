// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/distance.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "preprocess/thin/euclidean.hpp"
#include "preprocess/thin/window_minimum.hpp"
#include "tests/support/instruction_sets.hpp"
#include "tests/unit/thin/brute_force.hpp"
#include "tests/unit/thin/itk_maurer.hpp"

namespace ecorche::thin {
namespace {

struct Trial {
  const char* name;
  Mask mask;
};

std::vector<Trial> trials() {
  std::vector<Trial> out;
  out.push_back({"one voxel", make_mask({1, 1, 1}, [](int, int, int) { return true; })});
  out.push_back({"all", make_mask({7, 9, 12}, [](int, int, int) { return true; })});
  out.push_back({"nothing", make_mask({5, 4, 3}, [](int, int, int) { return false; })});
  out.push_back({"sheet", make_mask({13, 11, 9}, [](int, int, int k) { return k == 4; })});
  out.push_back({"line", make_mask({70, 3, 3}, [](int, int j, int k) { return j == 1 && k == 1; })});
  out.push_back({"long rows", random_mask({120, 4, 3}, 0.97, 3)});
  out.push_back({"wide planes", random_mask({150, 9, 9}, 0.998, 5)});
  out.push_back({"tall", random_mask({3, 4, 70}, 0.985, 4)});
  out.push_back({"dense", random_mask({15, 13, 12}, 0.99, 1)});
  out.push_back({"half", random_mask({33, 8, 7}, 0.5, 2)});
  out.push_back({"ellipsoid", ellipsoid({17, 14, 20}, {7, 5, 8})});
  return out;
}

TEST(Distance, SquaresAreTheLeastOverAllBackground) {
  for (const Trial& t : trials()) {
    const DistanceMap map = distance_map(t.mask, DistanceMetric::euclidean, {});
    EXPECT_EQ(values_of(map), brute_distance<std::uint32_t>(t.mask, euclidean_cost)) << t.name;
    EXPECT_TRUE(std::holds_alternative<Field<std::uint16_t>>(map.values)) << t.name;
  }
}

TEST(Distance, ChamferIsTheLeastOverAllBackground) {
  for (const Trial& t : trials()) {
    const DistanceMap map = distance_map(t.mask, DistanceMetric::chamfer345, {});
    EXPECT_EQ(values_of(map), brute_distance<std::uint32_t>(t.mask, chamfer_cost)) << t.name;
    EXPECT_TRUE(std::holds_alternative<Field<std::uint8_t>>(map.values)) << t.name;
  }
}

TEST(Distance, MillimetresAreTheLeastSumAsDoublesRoundIt) {
  const std::array<double, 3> s{0.7, 1.3, 3.1};
  for (Trial& t : trials()) {
    t.mask.grid.spacing = s;
    const Field<double> mm = squared_distance_mm(t.mask, {});
    const auto slow = brute_distance<double>(t.mask, [&](int a, int b, int c) {
      const double x = s[0] * a, y = s[1] * b, z = s[2] * c;
      const double xx = x * x, yy = y * y, zz = z * z, xy = xx + yy;
      return xy + zz;
    });
    EXPECT_TRUE(std::equal(slow.begin(), slow.end(), mm.data())) << t.name;
  }
}

Mask deep(int n) {
  return make_mask({n, n, n}, [](int, int, int) { return true; });
}

TEST(Distance, WideSquaresAreTheNarrowOnesWhereThoseHold) {
  for (const Trial& t : trials()) {
    const Field<std::uint16_t> narrow = squared_distance<std::uint16_t>(t.mask, {});
    const Field<std::uint32_t> wide = squared_distance<std::uint32_t>(t.mask, {});
    EXPECT_TRUE(std::equal(narrow.data(), narrow.data() + narrow.size(), wide.data())) << t.name;
    EXPECT_TRUE(holds_all(narrow)) << t.name;
  }
  Field<std::uint16_t> large(3000000);
  std::fill_n(large.data(), large.size(), std::uint16_t{65534});
  EXPECT_TRUE(holds_all(large));
  large[2345678] = 65535;
  EXPECT_FALSE(holds_all(large));
}

TEST(Distance, WideChamferWhereBytesDoNotHoldIt) {
  const Mask mask = deep(171);
  const DistanceMap map = distance_map(mask, DistanceMetric::chamfer345, {});
  ASSERT_TRUE(std::holds_alternative<Field<std::uint16_t>>(map.values));
  for (int i = 0; i < 171; i += 3)
    EXPECT_EQ(map.at(mask.grid.offset(i, 85, 85)), 3U * static_cast<unsigned>(std::min(i + 1, 171 - i)));
}

TEST(Distance, MaurersMapOfItkIsTheSame) {
  for (const std::array<double, 3>& spacing : {std::array{1.0, 1.0, 1.0}, std::array{0.5, 1.25, 3.0}}) {
    for (Mask mask : {ellipsoid({40, 31, 52}, {17, 12, 24}), random_mask({30, 28, 26}, 0.995, 8),
                      random_mask({30, 28, 26}, 0.6, 9)}) {
      mask.grid.spacing = spacing;
      const std::vector<double> itk = foreign::maurer_squared(mask.grid, mask.inside);
      const Field<double> mm = squared_distance_mm(mask, {});
      const DistanceMap map = distance_map(mask, DistanceMetric::euclidean, {});
      // These spacings are dyadic, so that every square and sum is exact in either.
      for (std::size_t v = 0; v < itk.size(); ++v) {
        ASSERT_EQ(mm[v], itk[v]) << v;
        if (spacing[0] == 1.0) {
          ASSERT_EQ(map.at(v), itk[v]) << v;
        }
      }
    }
  }
}

TEST(Distance, TheSameForAnyNumberOfThreadsAndAnyInstructionSet) {
  Mask mask = random_mask({67, 35, 41}, 0.998, 12);
  mask.grid.spacing = {0.9, 1.1, 2.3};
  const auto plain = values_of(distance_map(mask, DistanceMetric::euclidean, {}));
  const Field<double> mm = squared_distance_mm(mask, {});
  tbb::task_arena(1).execute(
      [&] { EXPECT_EQ(values_of(distance_map(mask, DistanceMetric::euclidean, {})), plain); });
  test::for_instruction_sets([&] {
    EXPECT_EQ(values_of(distance_map(mask, DistanceMetric::euclidean, {})), plain);
    const Field<double> again = squared_distance_mm(mask, {});
    EXPECT_TRUE(std::equal(mm.data(), mm.data() + mm.size(), again.data()));
  });
}

template <class T>
void compare_with_plain_loops(std::uint32_t step, std::uint32_t values) {
  constexpr std::uint64_t most = std::numeric_limits<T>::max();
  std::mt19937 random(5);
  const std::size_t n = 40, width = 21, stride = 32;
  std::vector<T> in(n * stride, 0), out(n * width), cost(n + 2);
  for (std::size_t d = 0; d < cost.size(); ++d) cost[d] = static_cast<T>(std::min(d * d * step, most));
  for (std::size_t q = 0; q < n; ++q) {
    for (std::size_t x = 0; x < width; ++x) in[q * stride + x] = static_cast<T>(random() % values);
  }
  window_minimum(WindowJob<T>{in.data(), stride, out.data(), width, n, width, cost.data()});
  for (std::size_t q = 0; q < n; ++q) {
    for (std::size_t x = 0; x < width; ++x) {
      std::uint64_t best = cost[std::min(q + 1, n - q)];
      for (std::size_t p = 0; p < n; ++p)
        best = std::min<std::uint64_t>(best, std::uint64_t{in[p * stride + x]} + cost[p < q ? q - p : p - q]);
      ASSERT_EQ(out[q * width + x], std::min(best, most)) << q << " " << x;
    }
  }
}

TEST(Distance, RowsAgreeWithPlainLoopsAlsoWhereSumsDoNotFit) {
  compare_with_plain_loops<std::uint32_t>(70001, 90000000);
  compare_with_plain_loops<std::uint16_t>(1, 900);
  compare_with_plain_loops<std::uint16_t>(9000, 65536);
}

TEST(Distance, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  Context context;
  context.stop = source.get_token();
  const Mask mask = deep(20);
  for (const DistanceMetric metric : {DistanceMetric::euclidean, DistanceMetric::chamfer345})
    EXPECT_THROW(distance_map(mask, metric, context), Error);
}

}  // namespace
}  // namespace ecorche::thin
