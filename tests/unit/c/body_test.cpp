// SPDX-License-Identifier: Apache-2.0
// What the C ABI gives is, bit for bit, what the classes behind it give.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <thread>
#include <vector>

#include <ecorche/kinematics/named_angles.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/runtime/quality_meter.hpp>
#include <ecorche/runtime/verdict.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include <ecorche/version.hpp>
#include "runtime/quality/bone_overlaps.hpp"
#include "tests/unit/c/opened_toy.hpp"

namespace ecorche::c {
namespace {

class Bodies : public OpenedToy {
 protected:
  // The classes' own answer.
  runtime::PosedBody posed(double flexion, runtime::Skinning skinning = runtime::Skinning::cor) const {
    const runtime::BodyPoser poser(toy);
    runtime::PosedBody out = poser.make_frame({.positions = true, .normals = true});
    const auto angle = kinematics::find_named_angle(toy->rig.skeleton, "middle_joint", "flexion");
    EXPECT_TRUE(poser
                    .run(kinematics::pose_of(toy->rig.skeleton, {{*angle, flexion}}), skinning,
                         poser.all_tissues(), out)
                    .ok());
    return out;
  }
};

TEST_F(Bodies, SurfacesOfEveryMethodAreThoseOfTheClasses) {
  for (const auto skinning : {ECORCHE_SKINNING_LBS, ECORCHE_SKINNING_DQS, ECORCHE_SKINNING_COR}) {
    bend(0.8, skinning);
    const runtime::PosedBody wanted = posed(0.8, static_cast<runtime::Skinning>(skinning));
    for (std::uint32_t t = 0; t < toy->tissues.size(); ++t) {
      EXPECT_EQ(std::memcmp(ecorche_body_positions(body, t), wanted.tissues[t].data(),
                            4 * wanted.tissues[t].size()),
                0);
      EXPECT_EQ(
          std::memcmp(ecorche_body_normals(body, t), wanted.normals[t].data(), 2 * wanted.normals[t].size()),
          0);
    }
  }
}

TEST_F(Bodies, ANewBodyIsTheScannedOne) {
  for (std::uint32_t t = 0; t < toy->tissues.size(); ++t) {
    const float* const at = ecorche_body_positions(body, t);
    for (Eigen::Index i = 0; i < toy->tissues[t].V.size(); ++i)
      EXPECT_NEAR(at[i], toy->tissues[t].V.data()[i], 1e-3);
  }
}

TEST_F(Bodies, OnlyTheTissuesThatWereAskedForAreThere) {
  const std::uint32_t one = 1;
  ASSERT_EQ(ecorche_body_update(body, pose, ECORCHE_SKINNING_COR, &one, 1), ECORCHE_OK);
  EXPECT_EQ(ecorche_body_positions(body, 0), nullptr);
  EXPECT_EQ(ecorche_body_normals(body, 0), nullptr);
  EXPECT_NE(ecorche_body_positions(body, 1), nullptr);
  std::array<float, 3> room{};
  EXPECT_EQ(ecorche_body_copy(body, 0, ECORCHE_SPACE_UNITY, room.data(), 0, nullptr, 0, 1),
            ECORCHE_FAILED_PRECONDITION);
  EXPECT_STREQ(ecorche_error_message(), "tissue: the last update did not pose it (name it there)");
}

TEST_F(Bodies, VerticesGoIntoTheCallersOwnInItsSpace) {
  struct Vertex {
    std::array<float, 3> at{}, normal{};
    float uv = 5;
  };
  bend(0.8);
  const runtime::PosedBody wanted = posed(0.8);
  const std::size_t count = wanted.tissues[0].size() / 3;
  std::vector<Vertex> out(count);
  ASSERT_EQ(ecorche_body_copy(body, 0, ECORCHE_SPACE_UNITY, out[0].at.data(), sizeof(Vertex),
                              out[0].normal.data(), sizeof(Vertex), count),
            ECORCHE_OK)
      << ecorche_error_message();
  for (std::size_t i = 0; i < count; ++i) {
    const float* const p = &wanted.tissues[0][3 * i];
    const std::int16_t* const n = &wanted.normals[0][3 * i];
    const std::array<float, 3> at{-p[0] / 1000, p[2] / 1000, -p[1] / 1000};
    const std::array<int, 3> normal{-n[0], n[2], -n[1]};
    double length = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(out[i].at[c], at[c], 1e-6);
      EXPECT_NEAR(out[i].normal[c], normal[c] / 32767.0, 1e-6);
      length += static_cast<double>(out[i].normal[c]) * static_cast<double>(out[i].normal[c]);
    }
    EXPECT_NEAR(length, 1, 1e-3);
    EXPECT_EQ(out[i].uv, 5);
  }
  EXPECT_EQ(ecorche_body_copy(body, 0, ECORCHE_SPACE_UNITY, out[0].at.data(), sizeof(Vertex), nullptr, 0,
                              count - 1),
            ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_error_message(), "capacity: the tissue has " + std::to_string(count) + " vertices");
}

TEST_F(Bodies, ABodyWithoutNormalsHasNone) {
  ecorche_body_options options = ECORCHE_BODY_OPTIONS_INIT;
  options.normals = 0;
  options.threads = 1;
  ecorche_body* plain = nullptr;
  ASSERT_EQ(ecorche_body_create(model, &options, &plain), ECORCHE_OK);
  EXPECT_EQ(ecorche_body_normals(plain, 0), nullptr);
  std::vector<float> room(3 * 10'000);
  EXPECT_EQ(ecorche_body_copy(plain, 0, ECORCHE_SPACE_LPS_MM, nullptr, 0, room.data(), 0, 10'000),
            ECORCHE_FAILED_PRECONDITION);
  EXPECT_STREQ(ecorche_error_message(), "normals: the body has none (see ecorche_body_options)");
  bend(0.5);
  ASSERT_EQ(ecorche_body_update(plain, pose, ECORCHE_SKINNING_COR, nullptr, 0), ECORCHE_OK);
  EXPECT_EQ(std::memcmp(ecorche_body_positions(plain, 0), ecorche_body_positions(body, 0),
                        4 * posed(0.5).tissues[0].size()),
            0)
      << "whatever the number of threads";
  ecorche_body_destroy(plain);
}

TEST_F(Bodies, LimitsAreKeptAndTold) {
  bend(3);
  ASSERT_EQ(ecorche_body_clamped_count(body), 1U);
  std::uint32_t segment = 0;
  double removed = 0;
  ASSERT_EQ(ecorche_body_clamped(body, 0, &segment, &removed), ECORCHE_OK);
  EXPECT_EQ(segment, 1U);
  EXPECT_NEAR(removed, 0.5, 1e-6);
  EXPECT_EQ(ecorche_body_clamped(body, 1, &segment, &removed), ECORCHE_INVALID_ARGUMENT);
  EXPECT_STREQ(ecorche_error_message(), "row: is not below ecorche_body_clamped_count");
}

TEST_F(Bodies, MotionsCarryTheBonesThere) {
  bend(0.8);
  for (std::uint32_t t = 0; t < toy->tissues.size(); ++t) {
    const Tissue& tissue = toy->tissues[t];
    if (tissue.segment < 0) continue;
    Eigen::Matrix<double, 3, 4, Eigen::RowMajor> motion;
    ASSERT_EQ(ecorche_body_motion(body, static_cast<std::uint32_t>(tissue.segment), motion.data()),
              ECORCHE_OK);
    const Eigen::Vector3d there = motion * tissue.V.row(0).cast<double>().transpose().homogeneous();
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(ecorche_body_positions(body, t)[c], there[c], 1e-2);
  }
}

TEST_F(Bodies, AnglesOfAJointStayBesideEachOther) {
  ecorche_angle_info info = ECORCHE_ANGLE_INFO_INIT;
  ASSERT_EQ(ecorche_model_angle_count(model), 9U);
  ASSERT_EQ(ecorche_model_angle(model, 7, &info), ECORCHE_OK);
  EXPECT_STREQ(info.joint, "tip_joint");
  EXPECT_STREQ(info.name, "tilt");
  EXPECT_EQ(info.segment, 2U);
  EXPECT_TRUE(std::isinf(info.max));
  // Beyond a quarter turn, where the rotation alone would be told by other angles.
  for (const double tilt : {0.4, 1.9}) {
    ASSERT_EQ(ecorche_pose_set_angle_at(pose, 7, tilt), ECORCHE_OK);
    ASSERT_EQ(ecorche_pose_set_angle(pose, "tip_joint", "flexion", 0.3), ECORCHE_OK);
    ASSERT_EQ(ecorche_pose_set_angle(pose, "tip_joint", "twist", -0.2), ECORCHE_OK);
    for (const auto& [row, wanted] : {std::pair(6U, 0.3), std::pair(7U, tilt), std::pair(8U, -0.2)}) {
      double angle = 0;
      ASSERT_EQ(ecorche_pose_angle(pose, row, &angle), ECORCHE_OK);
      EXPECT_EQ(angle, wanted);
    }
  }
  std::array<double, 4> q{};
  ASSERT_EQ(ecorche_pose_rotation(pose, 2, q.data()), ECORCHE_OK);
  const Eigen::Quaterniond wanted = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(1.9, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitZ());
  EXPECT_LT(Eigen::Quaterniond(q[3], q[0], q[1], q[2]).angularDistance(wanted), 1e-12);
  ASSERT_EQ(ecorche_pose_reset(pose), ECORCHE_OK);
  ASSERT_EQ(ecorche_pose_rotation(pose, 2, q.data()), ECORCHE_OK);
  EXPECT_EQ(q, (std::array<double, 4>{0, 0, 0, 1}));
  ASSERT_EQ(ecorche_pose_set_rotation(pose, 2, wanted.coeffs().data()), ECORCHE_OK);
  double angle = 0;
  ASSERT_EQ(ecorche_pose_angle(pose, 8, &angle), ECORCHE_OK);
  EXPECT_NE(angle, 0);
}

TEST_F(Bodies, TheRootCarriesAll) {
  const std::array<double, 3> to{10, -20, 300};
  ASSERT_EQ(ecorche_pose_set_root(pose, to.data()), ECORCHE_OK);
  ASSERT_EQ(ecorche_body_update(body, pose, ECORCHE_SKINNING_COR, nullptr, 0), ECORCHE_OK);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(ecorche_body_positions(body, 0)[c],
                static_cast<double>(toy->tissues[0].V(0, c)) + to[static_cast<std::size_t>(c)], 1e-3);
}

TEST_F(Bodies, QualityIsThatOfTheClasses) {
  bend(2.2);
  const runtime::PosedBody wanted = posed(2.2);
  const runtime::BodyPoser poser(toy);
  for (const int sampled : {0, 1}) {
    runtime::PoseQuality quality = sampled != 0
                                       ? runtime::QualityMeter(toy).measure(wanted, poser.all_tissues())
                                       : runtime::measure(*toy, wanted, poser.all_tissues());
    if (sampled == 0) {
      quality.overlap = runtime::BoneOverlaps(*toy).deepest(wanted.segments);
      runtime::judge({}, quality);
    }
    ecorche_quality told = ECORCHE_QUALITY_INIT;
    ASSERT_EQ(ecorche_body_measure(body, sampled, &told), ECORCHE_OK) << ecorche_error_message();
    EXPECT_EQ(told.pass != 0, quality.pass);
    EXPECT_EQ(told.inverted_tets, quality.inverted_tets);
    EXPECT_EQ(told.inverted_share, quality.inverted_share);
    EXPECT_EQ(told.min_det_f, quality.min_det_f);
    EXPECT_EQ(told.volume_change, quality.volume_change);
    EXPECT_EQ(told.bone_rigidity, quality.bone_rigidity_mm);
    EXPECT_EQ(told.bone_overlap, quality.overlap.mm);
    EXPECT_EQ(told.reason_count == 0, quality.pass);
    ASSERT_GT(told.reason_count, 0U) << "bent so far it does not pass";
    for (std::uint32_t row = 0; row < told.reason_count; ++row) {
      ecorche_reason reason = ECORCHE_REASON_INIT;
      ASSERT_EQ(ecorche_body_reason(body, row, &reason), ECORCHE_OK);
      EXPECT_GT(reason.value, reason.threshold);
      EXPECT_GT(std::strlen(reason.figure), 4U);
      const std::string figure = reason.figure;
      EXPECT_EQ(std::strlen(reason.name) > 0, figure == "tissue_change" || figure == "bone_overlap")
          << figure;
    }
    ecorche_reason reason = ECORCHE_REASON_INIT;
    EXPECT_EQ(ecorche_body_reason(body, told.reason_count, &reason), ECORCHE_INVALID_ARGUMENT);
  }
}

TEST_F(Bodies, VolumesAndSlicesAreThoseOfTheClasses) {
  bend(0.8);
  const runtime::PosedBody wanted = posed(0.8);
  ASSERT_EQ(ecorche_model_volume_count(model), toy->volumes.size());
  for (std::uint32_t v = 0; v < toy->volumes.size(); ++v) {
    ecorche_volume_info info = ECORCHE_VOLUME_INFO_INIT;
    ASSERT_EQ(ecorche_model_volume(model, v, &info), ECORCHE_OK);
    EXPECT_EQ(info.name, toy->volumes[v].name);
    EXPECT_EQ(info.labels != 0, toy->volumes[v].labels);
    EXPECT_EQ(std::memcmp(info.rest, toy->volumes[v].image.bytes.data(), toy->volumes[v].image.bytes.size()),
              0);
    ecorche_grid grid{};
    ASSERT_EQ(ecorche_body_volume_grid(body, v, &grid), ECORCHE_OK);
    const ImageGrid grown = runtime::grow_to(toy->volumes[v].image.grid, wanted.nodes);
    EXPECT_TRUE(std::equal(grown.size.begin(), grown.size.end(), grid.size));
    for (const bool slice : {false, true}) {
      const auto middle = grid.size[2] / 2;
      if (slice) grid.origin[2] += grid.spacing[2] * middle, grid.size[2] = 1;
      ImageGrid at = grown;
      std::copy_n(grid.size, 3, at.size.begin());
      std::copy_n(grid.origin, 3, at.origin.begin());
      const Image image =
          runtime::pose_volume(toy, wanted.nodes, toy->volumes[v], runtime::Sampling::trilinear, at);
      std::vector<std::byte> voxels(image.bytes.size());
      ASSERT_EQ(ecorche_body_volume(body, v, &grid, 0, voxels.data(), voxels.size()), ECORCHE_OK)
          << ecorche_error_message();
      EXPECT_EQ(voxels, image.bytes);
      EXPECT_EQ(ecorche_body_volume(body, v, &grid, 0, voxels.data(), voxels.size() - 1),
                ECORCHE_INVALID_ARGUMENT);
    }
  }
}

TEST_F(Bodies, PointsGoThereAndBack) {
  bend(0.8);
  const std::vector<float> points{0, 0, 20, 5, -5, 150, 3, 2, 250, 0, 0, 2000};
  std::vector<float> there(points.size()), back(points.size()), gradients(3 * points.size());
  std::vector<std::int32_t> tets(4), tissues(4);
  std::vector<double> values(4);
  ecorche_probed out = ECORCHE_PROBED_INIT;
  out.points = there.data();
  out.tets = tets.data();
  out.tissues = tissues.data();
  out.gradients = gradients.data();
  out.values = values.data();
  ASSERT_EQ(ecorche_body_rest_to_posed(body, points.data(), 4, &out), ECORCHE_OK) << ecorche_error_message();
  const std::vector<double> scanned = values;
  ecorche_probed home = ECORCHE_PROBED_INIT;
  home.points = back.data();
  home.values = values.data();
  ASSERT_EQ(ecorche_body_posed_to_rest(body, there.data(), 4, &home), ECORCHE_OK);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(back[i], points[i], 1e-3);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_GE(tets[i], 0);
    EXPECT_GE(tissues[i], 0);
    EXPECT_NEAR(values[i], scanned[i], 1e-3);
  }
  EXPECT_EQ(tets[3], -1);
  EXPECT_EQ(tissues[3], -1);
  EXPECT_TRUE(std::isnan(there[9]) && std::isnan(back[11]) && std::isnan(gradients[27]));
  EXPECT_NEAR(gradients[0], 1, 1e-3) << "the base stays";
  // After the next pose they go elsewhere.
  bend(-0.8);
  std::vector<float> other(points.size());
  out.points = other.data();
  ASSERT_EQ(ecorche_body_rest_to_posed(body, points.data(), 4, &out), ECORCHE_OK);
  // Three times as many floats would be one and a third of a point, by the size of an address.
  EXPECT_EQ(ecorche_body_rest_to_posed(body, points.data(), SIZE_MAX / 3 + 2, &out),
            ECORCHE_INVALID_ARGUMENT);
  EXPECT_STREQ(ecorche_error_message(), "count: is more than 4294967295 points");
  EXPECT_GT(std::abs(other[7] - there[7]), 20);
}

TEST_F(Bodies, OneModelServesManyThreads) {
  std::vector<std::thread> threads;
  std::array<int, 4> failed{};
  for (std::size_t k = 0; k < failed.size(); ++k) {
    threads.emplace_back([&, k] {
      ecorche_pose* own_pose = nullptr;
      ecorche_body* own = nullptr;
      failed[k] += ecorche_pose_create(model, &own_pose) + ecorche_body_create(model, nullptr, &own);
      for (int i = 0; i < 20; ++i) {
        failed[k] +=
            ecorche_pose_set_angle(own_pose, "middle_joint", "flexion", 0.1 * static_cast<double>(k));
        failed[k] += ecorche_body_update(own, own_pose, ECORCHE_SKINNING_COR, nullptr, 0);
        ecorche_quality quality = ECORCHE_QUALITY_INIT;
        failed[k] += ecorche_body_measure(own, i % 2, &quality);
        const std::array<float, 3> point{0, 0, 150};
        std::array<float, 3> to{};
        ecorche_probed out = ECORCHE_PROBED_INIT;
        out.points = to.data();
        failed[k] += ecorche_body_rest_to_posed(own, point.data(), 1, &out);
      }
      ecorche_body_destroy(own);
      ecorche_pose_destroy(own_pose);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(failed, (std::array<int, 4>{}));
}

TEST_F(Bodies, WhatTheModelHoldsIsTold) {
  EXPECT_EQ(ecorche_abi_version(), static_cast<unsigned>(ECORCHE_ABI_VERSION));
  EXPECT_STREQ(ecorche_version(), ECORCHE_VERSION);
  EXPECT_EQ(ecorche_model_name(model), toy->name);
  EXPECT_EQ(ecorche_model_identity(model), model_file::identity(*toy));
  ASSERT_EQ(ecorche_model_tissue_count(model), toy->tissues.size());
  for (std::uint32_t t = 0; t < toy->tissues.size(); ++t) {
    const Tissue& tissue = toy->tissues[t];
    ecorche_tissue_info info = ECORCHE_TISSUE_INFO_INIT;
    ASSERT_EQ(ecorche_model_tissue(model, t, &info), ECORCHE_OK);
    EXPECT_EQ(info.name, tissue.name);
    EXPECT_EQ(info.group, group_name(tissue.group));
    EXPECT_EQ(info.segment, tissue.segment);
    ASSERT_EQ(info.vertex_count, tissue.V.rows());
    ASSERT_EQ(info.triangle_count, tissue.F.rows());
    EXPECT_TRUE(std::equal(info.rest, info.rest + tissue.V.size(), tissue.V.data()));
    EXPECT_EQ(std::memcmp(info.triangles, tissue.F.data(), 4 * static_cast<std::size_t>(tissue.F.size())), 0);
    EXPECT_EQ(ecorche_model_find_tissue(model, tissue.name.c_str()), static_cast<std::int32_t>(t));
  }
  ASSERT_EQ(ecorche_model_segment_count(model), 3U);
  ecorche_segment_info segment = ECORCHE_SEGMENT_INFO_INIT;
  ASSERT_EQ(ecorche_model_segment(model, 2, &segment), ECORCHE_OK);
  EXPECT_STREQ(segment.name, "tip");
  EXPECT_STREQ(segment.joint, "tip_joint");
  EXPECT_EQ(segment.parent, 1);
  EXPECT_EQ(segment.centre[2], 200);
  EXPECT_EQ(segment.axes[0], 1);
  EXPECT_EQ(segment.confidence, 1);
  EXPECT_EQ(ecorche_model_find_segment(model, "tip"), 2);
  EXPECT_EQ(ecorche_model_find_segment(model, "tip_joint"), 2);
  EXPECT_EQ(ecorche_model_find_segment(model, "nose"), -1);
  EXPECT_EQ(ecorche_model_find_tissue(model, "nose"), -1);
}

}  // namespace
}  // namespace ecorche::c
