// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/mask.hpp"
#include "tests/unit/io/scratch.hpp"

#include <gtest/gtest.h>

#include <set>

#include "preprocess/thin/isotropic.hpp"
#include "tests/unit/thin/brute_force.hpp"

namespace ecorche::thin {
namespace {

template <class T>
Image image_of(const Index& size, int components, const std::function<T(int, int, int, int)>& value) {
  ImageGrid grid;
  grid.size = size;
  Image image(grid, scalar_type_of<T>, components);
  auto out = image.scalars<T>();
  std::size_t at = 0;
  for (int k = 0; k < size[2]; ++k) {
    for (int j = 0; j < size[1]; ++j) {
      for (int i = 0; i < size[0]; ++i) {
        for (int c = 0; c < components; ++c) out[at++] = value(i, j, k, c);
      }
    }
  }
  return image;
}

std::size_t count(const Mask& mask) {
  return static_cast<std::size_t>(std::count(mask.inside.begin(), mask.inside.end(), 1));
}

TEST(Mask, ThresholdsOfEveryScalarTypeAndComponent) {
  for (const ScalarType type : {ScalarType::u8, ScalarType::i8, ScalarType::u16, ScalarType::i16,
                                ScalarType::u32, ScalarType::i32, ScalarType::f32, ScalarType::f64}) {
    with_scalar_type(type, [&](auto zero) {
      using T = decltype(zero);
      const Image image = image_of<T>(
          {10, 2, 3}, 3, [](int i, int, int, int c) { return static_cast<T>(c == 1 ? i * 10 : 1); });
      Segmentation how;
      how.low = 30;
      how.high = 60;
      how.component = 1;
      const Mask mask = segment(image, how, {});
      EXPECT_EQ(count(mask), 4U * 6);
      for (std::size_t v = 0; v < mask.inside.size(); ++v)
        EXPECT_EQ(mask.inside[v] != 0, v % 10 >= 3 && v % 10 <= 6);
      how.high.reset();
      EXPECT_EQ(count(segment(image, how, {})), 7U * 6);
    });
  }
}

TEST(Mask, LabelsAndNothingSaid) {
  const Image image = image_of<std::int16_t>(
      {8, 1, 1}, 1, [](int i, int, int, int) { return static_cast<std::int16_t>(i - 3); });
  const Image positive =
      image_of<std::int16_t>({8, 1, 1}, 1, [](int i, int, int, int) { return static_cast<std::int16_t>(i); });
  Segmentation how;
  EXPECT_EQ(count(segment(positive, how, {})), 7U);  // all but the one 0
  how.labels = {4, -2, 99};
  const Mask mask = segment(image, how, {});
  EXPECT_EQ(mask.inside, (std::vector<std::uint8_t>{0, 1, 0, 0, 0, 0, 0, 1}));
}

TEST(Mask, NanIsNeverOfTheObject) {
  const Image image =
      image_of<float>({3, 1, 1}, 1, [](int i, int, int, int) { return i == 1 ? std::nanf("") : 5.0F; });
  Segmentation how;
  how.low = -1e30;
  EXPECT_EQ(segment(image, how, {}).inside, (std::vector<std::uint8_t>{1, 0, 1}));
}

TEST(Mask, RefusesWhatItCannotMean) {
  const Image whole =
      image_of<std::uint8_t>({4, 1, 1}, 2, [](int, int, int, int) { return std::uint8_t{1}; });
  const Image real = image_of<float>({4, 1, 1}, 1, [](int, int, int, int) { return 1.0F; });
  const auto fails = [](const Image& image, const Segmentation& how, ErrorKind kind, const char* where) {
    try {
      segment(image, how, {});
      ADD_FAILURE() << where;
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), kind) << e.what();
      EXPECT_EQ(e.where(), where);
    }
  };
  const Image below = image_of<std::int16_t>(
      {4, 1, 1}, 1, [](int i, int, int, int) { return static_cast<std::int16_t>(i - 1); });
  Segmentation how;
  fails(real, how, ErrorKind::usage, "--threshold");
  fails(below, how, ErrorKind::usage, "--threshold");
  how.labels = {1};
  fails(real, how, ErrorKind::usage, "--labels");
  how.low = 0;
  fails(whole, how, ErrorKind::usage, "--labels");
  how = {};
  how.component = 2;
  fails(whole, how, ErrorKind::usage, "--component");
  how.component = 0;
  how.low = 3;
  how.high = 2;
  fails(whole, how, ErrorKind::usage, "--threshold");
  how.high = 9;
  fails(whole, how, ErrorKind::data, "image");  // an empty mask
}

// Pieces by flooding, voxel by voxel.
std::vector<std::size_t> flooded_sizes(const Mask& mask, int reach) {
  const Index& n = mask.grid.size;
  std::vector<std::uint8_t> left = mask.inside;
  std::vector<std::size_t> sizes;
  for (std::size_t start = 0; start < left.size(); ++start) {
    if (left[start] == 0) continue;
    std::vector<std::size_t> open{start};
    left[start] = 0;
    sizes.push_back(0);
    while (!open.empty()) {
      const std::size_t v = open.back();
      open.pop_back();
      ++sizes.back();
      const int i = static_cast<int>(v) % n[0], j = static_cast<int>(v) / n[0] % n[1],
                k = static_cast<int>(v) / n[0] / n[1];
      for (int d = 0; d < 27; ++d) {
        const int x = d % 3 - 1, y = d / 3 % 3 - 1, z = d / 9 - 1;
        const int a = i + x, b = j + y, c = k + z;
        if (x * x + y * y + z * z > reach || a < 0 || b < 0 || c < 0 || a >= n[0] || b >= n[1] || c >= n[2])
          continue;
        const std::size_t to = mask.grid.offset(a, b, c);
        if (left[to] == 0) continue;
        left[to] = 0;
        open.push_back(to);
      }
    }
  }
  return sizes;
}

TEST(Mask, PiecesAreThoseOfAFlood) {
  for (const double share : {0.05, 0.12, 0.3, 0.5}) {
    const Mask mask = random_mask({17, 13, 15}, share, static_cast<unsigned>(share * 100));
    for (const Boundary boundary : {Boundary::faces_6, Boundary::all_26}) {
      const auto sizes = flooded_sizes(mask, boundary == Boundary::faces_6 ? 3 : 1);
      const Pieces found = pieces(mask, boundary, {});
      EXPECT_EQ(found.count, sizes.size());
      EXPECT_EQ(found.voxels, count(mask));
      EXPECT_EQ(found.largest_voxels, *std::max_element(sizes.begin(), sizes.end()));
      const Mask largest = largest_piece(mask, boundary, {});
      EXPECT_EQ(count(largest), found.largest_voxels);
      EXPECT_EQ(pieces(largest, boundary, {}).count, 1U);
    }
  }
}

TEST(Mask, BoundaryByFacesAndByAll) {
  const Mask mask = make_mask({5, 5, 5}, [](int i, int j, int k) { return i + j + k < 8; });
  const auto six = boundary_voxels(mask, Boundary::faces_6), all = boundary_voxels(mask, Boundary::all_26);
  const auto at = [&](int i, int j, int k) { return mask.grid.offset(i, j, k); };
  EXPECT_EQ(six[at(0, 2, 2)], 1);  // behind its face the image ends
  EXPECT_EQ(six[at(2, 2, 2)], 0);
  EXPECT_EQ(six[at(2, 2, 3)], 1);
  EXPECT_EQ(all[at(2, 2, 2)], 1);  // 3, 3, 2 is background
  EXPECT_EQ(all[at(1, 2, 2)], 1);  // 2, 3, 3 as well
  EXPECT_EQ(all[at(1, 1, 1)], 0);
}

TEST(Isotropic, KeepsWhatIsLinearAndWhereItLies) {
  Image image = image_of<double>(
      {8, 6, 5}, 2, [](int i, int j, int k, int c) { return c == 0 ? -1.0 : 3.0 * i - 2.0 * j + 10.0 * k; });
  image.grid.spacing = {0.5, 1, 2};
  image.grid.origin = {4, -7, 100};
  image.grid.direction = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  const Image out = to_isotropic(image, 1, 0, Sampling::trilinear, {});
  EXPECT_EQ(out.grid.size, (Index{8, 12, 20}));
  EXPECT_EQ(out.grid.spacing, (std::array<double, 3>{0.5, 0.5, 0.5}));
  EXPECT_EQ(out.components, 1);
  const auto values = out.scalars<double>();
  for (int k = 2; k < 18; ++k) {
    for (int j = 1; j < 11; ++j) {
      for (int i = 0; i < 8; ++i) {
        const auto at = image.grid.index(out.grid.point(i, j, k));
        EXPECT_NEAR(values[out.grid.offset(i, j, k)], 3 * at[0] - 2 * at[1] + 10 * at[2], 1e-9);
      }
    }
  }
  // The lower corner of the box stays.
  const auto a = image.grid.point(-0.5, -0.5, -0.5), b = out.grid.point(-0.5, -0.5, -0.5);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 1e-12);
}

TEST(Isotropic, LabelsAreNeverMixed) {
  Image image = image_of<std::uint8_t>({9, 7, 4}, 1, [](int i, int j, int k, int) {
    return static_cast<std::uint8_t>((i * 31 + j * 17 + k * 5) % 7 * 30);
  });
  image.grid.spacing = {1, 1.3, 2.9};
  const Image out = to_isotropic(image, 0, 0.8, Sampling::nearest, {});
  const auto in = image.scalars<std::uint8_t>();
  const auto values = out.scalars<std::uint8_t>();
  for (int k = 0; k < out.grid.size[2]; ++k) {
    for (int j = 0; j < out.grid.size[1]; ++j) {
      for (int i = 0; i < out.grid.size[0]; ++i) {
        auto at = image.grid.index(out.grid.point(i, j, k));
        for (std::size_t c = 0; c < 3; ++c)
          at[c] = std::clamp(std::floor(at[c] + 0.5 + 1e-9), 0.0, image.grid.size[c] - 1.0);
        EXPECT_EQ(
            values[out.grid.offset(i, j, k)],
            in[image.grid.offset(static_cast<int>(at[0]), static_cast<int>(at[1]), static_cast<int>(at[2]))]);
      }
    }
  }
}

TEST(Isotropic, RefusesEdgesAndComponentsThatCannotBe) {
  const Image image =
      image_of<std::uint8_t>({4, 4, 4}, 1, [](int, int, int, int) { return std::uint8_t{1}; });
  EXPECT_THROW(to_isotropic(image, 1, 0, Sampling::nearest, {}), Error);
  expect_error(ErrorKind::usage, "--isotropic: an edge must be positive (give mm, or 0 for the finest axis)",
               [&] { to_isotropic(image, 0, -1, Sampling::nearest, {}); });
  EXPECT_THROW(to_isotropic(image, 0, std::nan(""), Sampling::nearest, {}), Error);
  EXPECT_THROW(to_isotropic(image, 0, 1e-5, Sampling::nearest, {}), Error);
  EXPECT_TRUE(is_isotropic(image.grid));
}

}  // namespace
}  // namespace ecorche::thin
