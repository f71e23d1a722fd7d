// SPDX-License-Identifier: Apache-2.0
// The toy in a file, opened by the C ABI, with a pose and a body.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include <ecorche/ecorche.h>
#include <ecorche/model_file/model_file.hpp>
#include "tests/support/toy_model.hpp"

namespace ecorche::c {

class OpenedToy : public testing::Test {
 protected:
  OpenedToy() : toy(std::make_shared<const Model>(test::toy_model())) {
    model_file::write(*toy, file, Context{});
    EXPECT_EQ(ecorche_model_open(file.c_str(), &model), ECORCHE_OK) << ecorche_error_message();
    EXPECT_EQ(ecorche_pose_create(model, &pose), ECORCHE_OK) << ecorche_error_message();
    EXPECT_EQ(ecorche_body_create(model, nullptr, &body), ECORCHE_OK) << ecorche_error_message();
  }
  ~OpenedToy() override {
    ecorche_model_close(model);  // pose and body keep it
    ecorche_body_destroy(body);
    ecorche_pose_destroy(pose);
    std::filesystem::remove(file);
  }
  OpenedToy(const OpenedToy&) = delete;
  OpenedToy& operator=(const OpenedToy&) = delete;

  void bend(double radians, ecorche_skinning skinning = ECORCHE_SKINNING_COR) {
    ASSERT_EQ(ecorche_pose_set_angle(pose, "middle_joint", "flexion", radians), ECORCHE_OK)
        << ecorche_error_message();
    ASSERT_EQ(ecorche_body_update(body, pose, skinning, nullptr, 0), ECORCHE_OK) << ecorche_error_message();
  }

  std::filesystem::path file =
      std::filesystem::temp_directory_path() /
      ("unit_c_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) + "_" +
       ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".hdf");
  std::shared_ptr<const Model> toy;
  ecorche_model* model = nullptr;
  ecorche_pose* pose = nullptr;
  ecorche_body* body = nullptr;
};

}  // namespace ecorche::c
