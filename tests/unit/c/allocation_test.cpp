// SPDX-License-Identifier: Apache-2.0
// A game's frame allocates nothing: counted over the whole process, which is why this is a test of its own.
#include <array>
#include <vector>

#include "tests/support/counted_new.hpp"
#include "tests/unit/c/opened_toy.hpp"

namespace ecorche::c {
namespace {

using Allocation = OpenedToy;

TEST_F(Allocation, AFrameAllocatesNothing) {
  ecorche_body_options options = ECORCHE_BODY_OPTIONS_INIT;
  options.threads = 1;
  ecorche_body* one = nullptr;
  ASSERT_EQ(ecorche_body_create(model, &options, &one), ECORCHE_OK);
  ecorche_grid grid{};
  ASSERT_EQ(ecorche_body_volume_grid(one, 0, &grid), ECORCHE_OK);
  std::vector<std::byte> voxels(1U << 20U);
  std::vector<float> positions(3 * 10'000), normals(3 * 10'000);
  const std::array<float, 3> point{0, 0, 150};
  std::array<float, 3> there{};
  ecorche_probed probed = ECORCHE_PROBED_INIT;
  probed.points = there.data();
  int failed = 0;
  const auto frame = [&](double angle) {
    failed += ecorche_pose_set_angle(pose, "middle_joint", "flexion", angle);
    failed += ecorche_body_update(one, pose, ECORCHE_SKINNING_COR, nullptr, 0);
    failed += ecorche_body_copy(one, 0, ECORCHE_SPACE_UNITY, positions.data(), 0, normals.data(), 0, 10'000);
    failed += ecorche_body_volume(one, 0, &grid, 0, voxels.data(), voxels.size());
    failed += ecorche_body_posed_to_rest(one, point.data(), 1, &probed);
  };
  frame(0.1);
  frame(0.2);
  const std::size_t before = test::allocated;
  for (int i = 0; i < 10; ++i) frame(0.03 * i);
  EXPECT_EQ(test::allocated - before, 0U);
  EXPECT_EQ(failed, 0);
  ecorche_body_destroy(one);
}

TEST_F(Allocation, TheCounterCounts) {
  const std::size_t before = test::allocated;
  ecorche_pose* other = nullptr;
  ASSERT_EQ(ecorche_pose_create(model, &other), ECORCHE_OK);
  EXPECT_GT(test::allocated, before) << "the library's operator new is this one";
  ecorche_pose_destroy(other);
}

}  // namespace
}  // namespace ecorche::c
