// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/solid_faces.hpp"

#include <gtest/gtest.h>

#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::parting {
namespace {

// 4 x 4 x 4 voxels of 1 mm, in the body where x < 1.5.
Image half() {
  ImageGrid grid;
  grid.size = {4, 4, 4};
  Image image(grid, ScalarType::u16);
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i)
        image.scalars<std::uint16_t>()[grid.offset(i, j, k)] = i < 2 ? voxel::soft : voxel::outside;
  return image;
}

using Corners = std::array<Eigen::Vector3d, 3>;

TEST(SolidFaces, counts_what_lies_in_the_body) {
  const Image voxels = half();
  const SolidFaces solid(voxels, std::nullopt);
  EXPECT_EQ(solid.share(Corners{{{0, 0, 0}, {1, 0, 0}, {0, 3, 3}}}), 1);
  EXPECT_EQ(solid.share(Corners{{{2, 0, 0}, {3, 0, 0}, {2, 3, 3}}}), 0);
  EXPECT_EQ(solid.share(Corners{{{-9, 0, 0}, {-8, 0, 0}, {-9, 1, 0}}}), 0) << "beyond the image is outside";
  const double across = solid.share(Corners{{{0, 0, 0}, {3, 0, 0}, {0, 3, 0}}});
  EXPECT_GT(across, 0.3);
  EXPECT_LT(across, 1);
}

TEST(SolidFaces, skin_is_cheap_to_cut_and_flesh_all_the_same) {
  const Image voxels = half();
  CaseLabels labels;
  labels.image = Image(voxels.grid, ScalarType::u8);
  labels.image.scalars<std::uint8_t>()[voxels.grid.offset(0, 0, 0)] = 3;
  const Corners within{{{-0.2, 0, 0}, {0.2, 0, 0}, {0, 0.2, 0}}};
  for (const char* const name : {"Skin, arms", "skin", "SKIN_left"}) {
    labels.table = {{3, name}};
    const std::optional<CaseLabels> given = labels;
    const SolidFaces solid(voxels, given);
    EXPECT_NEAR(solid.price(within), SolidFaces::kSkin, 1e-12) << name;
    EXPECT_EQ(solid.share(within), 1);
  }
  for (const char* const name : {"skinfold", "oskin", "muscle"}) {
    labels.table = {{3, name}};
    const std::optional<CaseLabels> given = labels;
    EXPECT_EQ(SolidFaces(voxels, given).price(within), 1) << name;
  }
}

}  // namespace
}  // namespace ecorche::parting
