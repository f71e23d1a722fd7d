// SPDX-License-Identifier: Apache-2.0
// The bar of Sujar18 figure 7 in one pose: how much volume each method loses or gains.
// With ECORCHE_BAR_OUT set to a folder, writes the posed skins there for pictures.
#include <cstdio>
#include <map>
#include <numbers>

#include "core/kinematics/angles.hpp"
#include "io/surface/surface_file.hpp"
#include "runtime/quality/pose_quality.hpp"
#include "tests/unit/runtime/prepared_body.hpp"

namespace ecorche::runtime {
namespace {

constexpr double pi = std::numbers::pi;

void set_angle(const Rig& rig, Pose& pose, const std::string& name, std::size_t angle, double degrees) {
  const auto row = static_cast<std::size_t>(rig.skeleton.find_joint(name));
  std::array<double, 3> angles{0, 0, 0};
  angles[angle] = degrees * pi / 180;
  pose.rotation[row] = kinematics::rotation_from_angles(rig.skeleton.segments[row].joint, angles);
}

Pose figure_7(const Rig& rig) {
  Pose pose = Pose::rest(rig.skeleton.segments.size());
  set_angle(rig, pose, "joint_1", 0, 100);
  set_angle(rig, pose, "joint_2", 0, -100);
  set_angle(rig, pose, "joint_3", 2, 135);
  return pose;
}

void write_picture(const Model& model, const PosedBody& body, Skinning skinning) {
  const char* folder = std::getenv("ECORCHE_BAR_OUT");
  if (folder == nullptr) return;
  std::filesystem::create_directories(folder);
  for (std::size_t t = 0; t < model.tissues.size(); ++t) {
    SurfaceMesh mesh;
    mesh.V = Eigen::Map<const PointsF>(body.tissues[t].data(), model.tissues[t].V.rows(), 3).cast<double>();
    mesh.F = model.tissues[t].F;
    const std::string name = std::string(skinning_name(skinning)) + "_" + model.tissues[t].name + ".vtp";
    io::write_surface(std::filesystem::path(folder) / name, mesh);
  }
}

TEST(Bar, VolumeOfTheThreeMethodsInThePoseOfFigure7) {
  const auto model = test::read_model(test::environment("ECORCHE_BAR_MODEL"));
  const BodyPoser poser(model);
  PosedBody body = poser.make_frame();
  const Pose pose = figure_7(model->rig);
  std::size_t with_centre = 0;
  for (const std::uint8_t has : model->cor.has_centre) with_centre += has;
  std::printf("%zu tets, %zu nodes, %zu with a centre of rotation\n", model->tet_count(), model->node_count(),
              with_centre);
  std::printf("%-6s %12s %12s %14s %10s\n", "", "tets %", "skin %", "inverted tets", "min det F");
  std::map<Skinning, double> change;
  for (const Skinning skinning : test::all_skinnings) {
    ASSERT_TRUE(poser.run(pose, skinning, poser.all_tissues(), body).ok());
    ASSERT_TRUE(body.clamped.empty()) << "the bar's joints are free";
    const PoseQuality quality = measure(*model, body, poser.all_tissues());
    change[skinning] = quality.tissues.front().share;
    std::printf("%-6s %+12.2f %+12.2f %14llu %10.3f\n", std::string(skinning_name(skinning)).c_str(),
                100 * quality.volume_change, 100 * quality.tissues.front().share,
                static_cast<unsigned long long>(quality.inverted_tets), quality.min_det_f);
    write_picture(*model, body, skinning);
  }
  EXPECT_LT(change[Skinning::lbs], 0) << "LBS loses volume";
  EXPECT_GT(change[Skinning::dqs], 0) << "DQS gains volume";
  EXPECT_LT(std::abs(change[Skinning::cor]), std::abs(change[Skinning::lbs])) << "CoR stays nearest to rest";
  EXPECT_LT(std::abs(change[Skinning::cor]), std::abs(change[Skinning::dqs])) << "CoR stays nearest to rest";
}

}  // namespace
}  // namespace ecorche::runtime
