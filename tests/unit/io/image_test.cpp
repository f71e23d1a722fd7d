// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "io/image/image_file.hpp"
#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

// An oblique left-handed grid: third axis reversed, then turned about x and z.
ImageGrid oblique_grid() {
  ImageGrid grid;
  grid.size = {5, 4, 3};
  grid.origin = {-12.5, 30.25, 7.125};
  grid.spacing = {0.5, 0.75, 2.5};
  const double c = std::cos(0.3), s = std::sin(0.3);
  grid.direction = {c, -s, 0, s, c, 0, 0, 0, -1};
  return grid;
}

Image noise(ScalarType type, int components) {
  Image image(oblique_grid(), type, components);
  std::mt19937 random(7);
  with_scalar_type(type, [&](auto t) {
    for (auto& x : image.scalars<decltype(t)>())
      x = static_cast<decltype(t)>(static_cast<double>(random()) / 7.0);
  });
  return image;
}

void expect_same(const Image& a, const Image& b, double tolerance) {
  EXPECT_EQ(a.grid.size, b.grid.size);
  EXPECT_EQ(scalar_name(a.type), scalar_name(b.type));
  EXPECT_EQ(a.components, b.components);
  EXPECT_EQ(a.bytes, b.bytes);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(a.grid.spacing[i], b.grid.spacing[i], tolerance);
    EXPECT_NEAR(a.grid.origin[i], b.grid.origin[i], tolerance);
  }
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(a.grid.direction[i], b.grid.direction[i], tolerance);
}

TEST(Image, EveryTypeComesBackWhole) {
  const Scratch scratch;
  for (const char* name : {"a.nrrd", "a.mha"}) {
    for (int type = 0; type <= static_cast<int>(ScalarType::f64); ++type) {
      for (const int components : {1, 3}) {
        for (const bool compress : {false, true}) {
          const Image image = noise(static_cast<ScalarType>(type), components);
          write_image(scratch / name, image, compress);
          SCOPED_TRACE(std::string(name) + " " + std::string(scalar_name(image.type)) + " x " +
                       std::to_string(components));
          expect_same(read_image(scratch / name), image, 1e-12);
        }
      }
    }
  }
}

}  // namespace
}  // namespace ecorche::io
