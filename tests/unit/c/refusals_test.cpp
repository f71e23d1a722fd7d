// SPDX-License-Identifier: Apache-2.0
// What callers do wrong is refused in words, and what other versions of a struct hold is read and filled.
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <thread>
#include <vector>

#include "tests/unit/c/opened_toy.hpp"

namespace ecorche::c {
namespace {

using Refusals = OpenedToy;

std::string message() {
  return ecorche_error_message();
}

TEST_F(Refusals, FilesThatAreNoModels) {
  ecorche_model* none = nullptr;
  EXPECT_EQ(ecorche_model_open("/nowhere/body.hdf", &none), ECORCHE_NOT_FOUND);
  EXPECT_NE(message().find("/nowhere/body.hdf: "), std::string::npos) << message();
  const std::filesystem::path text = file.string() + ".txt";
  std::ofstream(text) << "no model";
  EXPECT_EQ(ecorche_model_open(text.c_str(), &none), ECORCHE_INVALID_ARGUMENT);
  EXPECT_NE(message().find("is not an HDF5 file"), std::string::npos) << message();
  std::filesystem::remove(text);
  EXPECT_EQ(none, nullptr);
  EXPECT_EQ(ecorche_model_open(nullptr, &none), ECORCHE_INVALID_ARGUMENT);
}

TEST_F(Refusals, MessagesAreUtf8WhateverTheNames) {
  EXPECT_EQ(ecorche_pose_set_angle(pose, "\xff", "a\xc3", 0), ECORCHE_NOT_FOUND);
  EXPECT_EQ(message().find("?.a?: "), 0U) << message();
  // Two bytes a character: of one of both paths the end of the buffer lies within one.
  for (std::string path : {"/nowhere/", "/nowhere1/"}) {
    for (int i = 0; i < 1000; ++i) path += "\xc3\xa9";
    ecorche_model* none = nullptr;
    EXPECT_NE(ecorche_model_open(path.c_str(), &none), ECORCHE_OK);
    EXPECT_EQ(message().back(), '\xa9') << "a whole character";
  }
}

TEST_F(Refusals, NullHandles) {
  std::array<double, 12> numbers{};
  std::array<float, 3> point{};
  std::uint32_t row = 0;
  ecorche_grid grid{};
  ecorche_probed probed = ECORCHE_PROBED_INIT;
  ecorche_quality quality = ECORCHE_QUALITY_INIT;
  ecorche_reason reason = ECORCHE_REASON_INIT;
  ecorche_tissue_info tissue = ECORCHE_TISSUE_INFO_INIT;
  ecorche_segment_info segment = ECORCHE_SEGMENT_INFO_INIT;
  ecorche_angle_info angle = ECORCHE_ANGLE_INFO_INIT;
  ecorche_volume_info volume = ECORCHE_VOLUME_INFO_INIT;
  ecorche_pose* no_pose = nullptr;
  ecorche_body* no_body = nullptr;
  const std::vector<ecorche_code> codes{
      ecorche_pose_create(nullptr, &no_pose),
      ecorche_body_create(nullptr, nullptr, &no_body),
      ecorche_model_tissue(nullptr, 0, &tissue),
      ecorche_model_segment(nullptr, 0, &segment),
      ecorche_model_angle(nullptr, 0, &angle),
      ecorche_model_volume(nullptr, 0, &volume),
      ecorche_pose_reset(nullptr),
      ecorche_pose_load(nullptr, "lib:sitting"),
      ecorche_pose_set_angle(nullptr, "a", "b", 0),
      ecorche_pose_set_angle_at(nullptr, 0, 0),
      ecorche_pose_angle(nullptr, 0, numbers.data()),
      ecorche_pose_set_rotation(nullptr, 0, numbers.data()),
      ecorche_pose_rotation(nullptr, 0, numbers.data()),
      ecorche_pose_set_root(nullptr, numbers.data()),
      ecorche_body_update(nullptr, pose, ECORCHE_SKINNING_COR, nullptr, 0),
      ecorche_body_update(body, nullptr, ECORCHE_SKINNING_COR, nullptr, 0),
      ecorche_body_copy(nullptr, 0, ECORCHE_SPACE_LPS_MM, point.data(), 0, nullptr, 0, 1),
      ecorche_body_motion(nullptr, 0, numbers.data()),
      ecorche_body_clamped(nullptr, 0, &row, numbers.data()),
      ecorche_body_measure(nullptr, 0, &quality),
      ecorche_body_reason(nullptr, 0, &reason),
      ecorche_body_volume_grid(nullptr, 0, &grid),
      ecorche_body_volume(nullptr, 0, &grid, 0, point.data(), 12),
      ecorche_body_posed_to_rest(nullptr, point.data(), 1, &probed),
      ecorche_body_rest_to_posed(body, nullptr, 1, &probed),
  };
  for (std::size_t i = 0; i < codes.size(); ++i) EXPECT_EQ(codes[i], ECORCHE_INVALID_ARGUMENT) << i;
  EXPECT_NE(message().find("is null"), std::string::npos);
  EXPECT_EQ(ecorche_model_name(nullptr), nullptr);
  EXPECT_EQ(ecorche_model_identity(nullptr), 0U);
  EXPECT_EQ(ecorche_model_tissue_count(nullptr) + ecorche_model_segment_count(nullptr) +
                ecorche_model_angle_count(nullptr) + ecorche_model_volume_count(nullptr) +
                ecorche_body_clamped_count(nullptr),
            0U);
  EXPECT_EQ(ecorche_body_positions(nullptr, 0), nullptr);
  EXPECT_EQ(ecorche_model_find_tissue(nullptr, "skin"), -1);
  ecorche_model_close(nullptr);
  ecorche_pose_destroy(nullptr);
  ecorche_body_destroy(nullptr);
}

TEST_F(Refusals, RowsThatAreNotThere) {
  ecorche_tissue_info tissue = ECORCHE_TISSUE_INFO_INIT;
  EXPECT_EQ(ecorche_model_tissue(model, 99, &tissue), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(message(), "tissue 99: the model has " + std::to_string(toy->tissues.size()) + " of them");
  ecorche_segment_info segment = ECORCHE_SEGMENT_INFO_INIT;
  EXPECT_EQ(ecorche_model_segment(model, 3, &segment), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(message(), "segment: the model has 3 of them");
  ecorche_angle_info angle = ECORCHE_ANGLE_INFO_INIT;
  EXPECT_EQ(ecorche_model_angle(model, 9, &angle), ECORCHE_INVALID_ARGUMENT);
  double radians = 0;
  EXPECT_EQ(ecorche_pose_set_angle_at(pose, 9, 0), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_pose_angle(pose, 9, &radians), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(message(), "angle: the model has 9 of them");
  std::array<double, 12> numbers{0, 0, 0, 1};
  EXPECT_EQ(ecorche_pose_set_rotation(pose, 3, numbers.data()), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_pose_rotation(pose, 3, numbers.data()), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(message(), "segment: the model has 3 of them");
  EXPECT_EQ(ecorche_body_motion(body, 3, numbers.data()), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_body_positions(body, 99), nullptr);
  ecorche_volume_info volume = ECORCHE_VOLUME_INFO_INIT;
  EXPECT_EQ(ecorche_model_volume(model, 9, &volume), ECORCHE_INVALID_ARGUMENT);
  EXPECT_NE(message().find("volume 9: the model has"), std::string::npos) << message();
  EXPECT_NE(message().find("see ecorche_model_volume_count"), std::string::npos) << message();
  double value = 0;
  const std::array<float, 3> point{};
  ecorche_probed probed = ECORCHE_PROBED_INIT;
  probed.values = &value;
  probed.volume = -1;
  EXPECT_EQ(ecorche_body_rest_to_posed(body, point.data(), 1, &probed), ECORCHE_INVALID_ARGUMENT);
}

TEST_F(Refusals, Poses) {
  EXPECT_EQ(ecorche_pose_set_angle(pose, "middle_joint", "yaw", 1), ECORCHE_NOT_FOUND);
  EXPECT_EQ(message(), "middle_joint.yaw: the model has no such angle (ecorche info lists them)");
  EXPECT_EQ(ecorche_pose_set_angle(pose, "middle_joint", "flexion", std::nan("")), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_pose_set_angle_at(pose, 0, std::numeric_limits<double>::infinity()),
            ECORCHE_INVALID_ARGUMENT);
  const std::array<double, 3> far{0, std::nan(""), 0};
  EXPECT_EQ(ecorche_pose_set_root(pose, far.data()), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(message(), "pose: holds a number that is not finite (give radians and millimetres)");
  const std::array<double, 4> q{0, 0, 0, 2};
  EXPECT_EQ(ecorche_pose_set_rotation(pose, 0, q.data()), ECORCHE_INVALID_ARGUMENT);
  EXPECT_NE(message().find("xyzw: has the length 2"), std::string::npos) << message();
  EXPECT_NE(message().find("give a unit quaternion"), std::string::npos) << message();
  EXPECT_EQ(ecorche_pose_load(pose, "lib:flying"), ECORCHE_INVALID_ARGUMENT);
  EXPECT_NE(message().find("arms_up"), std::string::npos) << message();
  EXPECT_EQ(ecorche_pose_load(pose, "/nowhere/pose.yaml"), ECORCHE_NOT_FOUND) << message();
  std::array<double, 3> beyond{1e12, 0, 0};
  ASSERT_EQ(ecorche_pose_set_root(pose, beyond.data()), ECORCHE_OK);
  EXPECT_EQ(ecorche_body_update(body, pose, ECORCHE_SKINNING_COR, nullptr, 0), ECORCHE_INVALID_ARGUMENT);
  EXPECT_NE(message(), "");
}

TEST_F(Refusals, APoseOfAnotherModel) {
  ecorche_model* again = nullptr;
  ecorche_pose* other = nullptr;
  ASSERT_EQ(ecorche_model_open(file.c_str(), &again), ECORCHE_OK);
  ASSERT_EQ(ecorche_pose_create(again, &other), ECORCHE_OK);
  EXPECT_EQ(ecorche_body_update(body, other, ECORCHE_SKINNING_COR, nullptr, 0), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(message(), "pose: is of another model than the body (create both from one)");
  ecorche_pose_destroy(other);
  ecorche_model_close(again);
}

TEST_F(Refusals, Updates) {
  EXPECT_EQ(ecorche_body_update(body, pose, static_cast<ecorche_skinning>(3), nullptr, 0),
            ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(message(), "skinning: there is no such method (see ecorche_skinning)");
  for (const std::array<std::uint32_t, 2> rows : {std::array<std::uint32_t, 2>{1, 0}, {1, 1}, {0, 99}}) {
    EXPECT_EQ(ecorche_body_update(body, pose, ECORCHE_SKINNING_COR, rows.data(), 2),
              ECORCHE_INVALID_ARGUMENT);
    EXPECT_EQ(message(), "tissues: are not ascending rows below " + std::to_string(toy->tissues.size()));
  }
  EXPECT_NE(ecorche_body_positions(body, 0), nullptr) << "the body stays as it was";
  ecorche_body_options options = ECORCHE_BODY_OPTIONS_INIT;
  options.threads = 5000;
  ecorche_body* many = nullptr;
  EXPECT_EQ(ecorche_body_create(model, &options, &many), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(message(), "threads: is more than 1024 (0 for one a processor)");
  std::array<float, 3> room{};
  EXPECT_EQ(ecorche_body_copy(body, 0, ECORCHE_SPACE_LPS_MM, room.data(), 4, nullptr, 0, 1'000'000),
            ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(message(), "stride: is less than three floats (12 bytes, or 0 for that)");
}

TEST_F(Refusals, Grids) {
  ecorche_grid good{};
  ASSERT_EQ(ecorche_body_volume_grid(body, 0, &good), ECORCHE_OK);
  std::vector<std::byte> room(1U << 20U);
  const auto refused = [&](const ecorche_grid& grid) {
    EXPECT_EQ(ecorche_body_volume(body, 0, &grid, 0, room.data(), room.size()), ECORCHE_INVALID_ARGUMENT);
    return message();
  };
  ecorche_grid grid = good;
  grid.size[1] = 0;
  EXPECT_NE(refused(grid).find("its size is not positive"), std::string::npos) << message();
  EXPECT_NE(message().find("a slice is one voxel thick"), std::string::npos);
  grid = good;
  grid.size[0] = grid.size[1] = 100'000;
  EXPECT_NE(refused(grid).find("has more than 2^31 voxels"), std::string::npos) << message();
  EXPECT_NE(message().find("ask for a part"), std::string::npos);
  grid = good;
  grid.spacing[2] = -1;
  EXPECT_NE(refused(grid).find("its origin or spacing is no place"), std::string::npos) << message();
  EXPECT_NE(message().find("give finite, positive millimetres"), std::string::npos);
  grid = good;
  grid.origin[0] = std::nan("");
  refused(grid);
  grid = good;
  grid.direction[0] = 2;
  EXPECT_NE(refused(grid).find("its direction is not orthonormal"), std::string::npos) << message();
  EXPECT_NE(message().find("give three axes at right angles"), std::string::npos);
}

TEST_F(Refusals, AStructOfAnOlderVersionIsFilledAsFarAsItGoes) {
  ecorche_tissue_info info = ECORCHE_TISSUE_INFO_INIT;
  info.struct_size = offsetof(ecorche_tissue_info, vertex_count);
  info.vertex_count = 77;
  ASSERT_EQ(ecorche_model_tissue(model, 0, &info), ECORCHE_OK);
  EXPECT_EQ(info.name, toy->tissues[0].name);
  EXPECT_EQ(info.vertex_count, 77U) << "beyond its end nothing is written";
  EXPECT_EQ(info.struct_size, offsetof(ecorche_tissue_info, vertex_count));
  info.struct_size = 0;
  EXPECT_EQ(ecorche_model_tissue(model, 0, &info), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(message(), "out: is null, or its struct_size is not set (begin with the _INIT macro)");
  EXPECT_EQ(ecorche_model_tissue(model, 0, nullptr), ECORCHE_INVALID_ARGUMENT);
  // A newer one: what this library does not know stays.
  struct Newer {
    ecorche_quality known = ECORCHE_QUALITY_INIT;
    double more = 5;
  } newer;
  newer.known.struct_size = sizeof(Newer);
  ASSERT_EQ(ecorche_body_measure(body, 0, &newer.known), ECORCHE_OK);
  EXPECT_EQ(newer.more, 5);
  EXPECT_EQ(newer.known.min_det_f, 1) << "as scanned";
}

TEST_F(Refusals, MessagesAreOfTheirThread) {
  EXPECT_EQ(ecorche_pose_set_angle(pose, "middle_joint", "yaw", 1), ECORCHE_NOT_FOUND);
  std::thread([] { EXPECT_STREQ(ecorche_error_message(), ""); }).join();
  EXPECT_NE(message(), "");
  const std::string long_name(5000, 'x');
  EXPECT_EQ(ecorche_pose_set_angle(pose, long_name.c_str(), "yaw", 1), ECORCHE_NOT_FOUND);
  EXPECT_EQ(message().size(), 1023U);
}

}  // namespace
}  // namespace ecorche::c
