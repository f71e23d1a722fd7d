// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "phantom/random.hpp"
#include "phantom/volume.hpp"
#include "tests/unit/phantom/mesh_checks.hpp"
#include "tests/unit/phantom/small_phantom.hpp"

namespace ecorche::phantom {
namespace {

TEST(Scan, LabelsAgreeWithTheMeshes) {
  const Case& patient = small_phantom().patient;
  const Image& labels = patient.labels->image;
  const auto values = labels.scalars<std::uint8_t>();
  std::map<std::string, const SurfaceMesh*> surfaces;
  for (const CaseBone& bone : patient.bones) surfaces[bone.name] = &bone.surface;
  for (const CaseTissue& tissue : patient.tissues) surfaces[tissue.name] = &tissue.surface;
  int checked = 0;
  for (const char* name : {"femur_left", "liver", "rectus_femoris_left", "heart", "gluteus_maximus_right",
                           "pelvis", "brain", "lung_left"}) {
    if (!surfaces.count(name)) continue;
    const Part& part = find_part(body().parts, name);
    const Box box = part.shape.box().grown(12);
    for (std::uint64_t i = 0; i < 400; ++i) {
      std::array<int, 3> at{};
      for (std::size_t a = 0; a < 3; ++a) {
        const double x =
            box.lo[static_cast<int>(a)] + uniform(11, 3 * i + a) * (box.hi - box.lo)[static_cast<int>(a)];
        at[a] =
            std::clamp(static_cast<int>(std::lround((x - labels.grid.origin[a]) / labels.grid.spacing[a])), 0,
                       labels.grid.size[a] - 1);
      }
      const auto p = labels.grid.point(at[0], at[1], at[2]);
      const Vec centre(p[0], p[1], p[2]);
      // The small phantom's triangles cut corners; half a voxel is 3 mm.
      if (std::abs(part.shape.distance(centre)) < 4.5) continue;
      const bool in_mesh = winding(*surfaces[name], centre) > 0.5;
      const std::uint8_t label = values[labels.grid.offset(at[0], at[1], at[2])];
      const auto entry = patient.labels->table.find(label);
      EXPECT_EQ(in_mesh, entry != patient.labels->table.end() && entry->second == name)
          << name << " at " << centre.transpose();
      ++checked;
    }
  }
  EXPECT_GT(checked, 1500);
}

TEST(Scan, EveryPartIsThere) {
  const CaseLabels& labels = *small_phantom().patient.labels;
  std::map<std::int64_t, int> voxels;
  for (const std::uint8_t value : labels.image.scalars<std::uint8_t>()) ++voxels[value];
  for (const auto& [id, name] : labels.table) EXPECT_GT(voxels[id], 3) << name;
  EXPECT_EQ(voxels.size(), labels.table.size() + 1);
}

TEST(Scan, LooksLikeCt) {
  const Case& patient = small_phantom().patient;
  const ImageGrid& grid = patient.volumes[0].image.grid;
  const auto ct = patient.volumes[0].image.scalars<std::int16_t>(),
             noisy = patient.volumes[1].image.scalars<std::int16_t>();
  EXPECT_EQ(patient.volumes[0].background, -1024);
  EXPECT_EQ(ct[0], -1024);
  const auto value_at = [&](const Vec& p) {
    const auto index = grid.index({p.x(), p.y(), p.z()});
    return ct[grid.offset(static_cast<int>(std::lround(index[0])), static_cast<int>(std::lround(index[1])),
                          static_cast<int>(std::lround(index[2])))];
  };
  EXPECT_LT(value_at({-60, 10, 1300}), -700);      // lung
  EXPECT_NEAR(value_at({-50, -10, 1180}), 95, 1);  // liver
  EXPECT_NEAR(value_at(body().at.hip), 250, 40);   // spongy bone
  double sum = 0, square = 0;
  int n = 0;
  for (std::size_t i = 0; i < ct.size(); ++i) {
    if (ct[i] <= -900) continue;
    const double d = noisy[i] - ct[i];
    sum += d, square += d * d, ++n;
  }
  EXPECT_NEAR(sum / n, 0, 0.3);
  EXPECT_NEAR(std::sqrt(square / n), 15, 0.5);
}

TEST(Scan, TilesChangeNothing) {
  // Against every voxel on its own.
  Part skin, ball;
  skin.group = Group::skin, skin.shape = ellipsoid({3, 1, 2}, {60, 35, 48}), skin.hounsfield = -90;
  ball.name = "ball", ball.group = Group::bone,
  ball.shape = unite({sphere({10, 0, 0}, 14), round_cone({0, 0, 0}, 8, {-30, 5, 9}, 5)}, 6),
  ball.hounsfield = 1100;
  const Scan scan = make_scan(skin, {ball}, skin.shape.box(), 3, 1, {});
  const auto labels = scan.labels.image.scalars<std::uint8_t>();
  const ImageGrid& grid = scan.labels.image.grid;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const auto p = grid.point(i, j, k);
        const Vec x(p[0], p[1], p[2]);
        const int expected = ball.shape.distance(x) < 0 ? 2 : skin.shape.distance(x) < 0 ? 1 : 0;
        ASSERT_EQ(labels[grid.offset(i, j, k)], expected) << x.transpose();
      }
    }
  }
}

}  // namespace
}  // namespace ecorche::phantom
