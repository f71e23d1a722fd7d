// SPDX-License-Identifier: Apache-2.0
// Rest pose in, rest pose out, through the whole machinery: meshes within 1e-3 mm, voxels identical.
#include <cstdio>

#include <ecorche/runtime/volume_poser.hpp>
#include "tests/unit/runtime/prepared_body.hpp"

namespace ecorche::runtime {
namespace {

bool is_outside(const Tissue& tissue, std::size_t vertex) {
  return tissue.segment == Tissue::by_tets &&
         tissue.barycentric.row(static_cast<Eigen::Index>(vertex)).minCoeff() < 0;
}

TEST(Rest, EveryTissueVertexComesBack) {
  std::printf("%-24s %-4s %10s %10s %12s %12s\n", "model", "", "vertices", "outside", "worst mm",
              "outside mm");
  for (const std::string& path : test::model_paths()) {
    const auto model = test::read_model(path);
    const BodyPoser poser(model);
    PosedBody body = poser.make_frame();
    for (const Skinning skinning : test::all_skinnings) {
      for (auto& tissue : body.tissues) std::fill(tissue.begin(), tissue.end(), 0.0F);
      ASSERT_TRUE(poser.run(Pose::rest(model->segment_count()), skinning, poser.all_tissues(), body).ok());
      std::size_t vertices = 0, outside = 0;
      double worst = 0, worst_outside = 0;
      for (std::size_t t = 0; t < model->tissues.size(); ++t) {
        const Tissue& tissue = model->tissues[t];
        for (std::size_t v = 0; v < body.tissues[t].size() / 3; ++v) {
          const Eigen::Map<const Eigen::RowVector3f> posed(&body.tissues[t][3 * v]);
          const double off = (posed - tissue.V.row(static_cast<Eigen::Index>(v))).cast<double>().norm();
          ++vertices;
          worst = std::max(worst, off);
          if (!is_outside(tissue, v)) continue;
          ++outside;
          worst_outside = std::max(worst_outside, off);
        }
      }
      std::printf("%-24s %-4s %10zu %10zu %12.2e %12.2e\n", test::short_name(path).c_str(),
                  std::string(skinning_name(skinning)).c_str(), vertices, outside, worst, worst_outside);
      EXPECT_LE(worst, 1e-3);
    }
  }
}

TEST(Rest, EveryVoxelInTheMeshIsIdenticalWithNearestSampling) {
  std::printf("%-24s %-10s %12s %12s %12s %14s\n", "model", "volume", "voxels", "in the mesh", "different",
              "mesh / voxels");
  for (const std::string& path : test::model_paths()) {
    const auto model = test::read_model(path);
    const BodyPoser poser(model);
    PosedBody body = poser.make_frame();
    ASSERT_TRUE(poser.run(Pose::rest(model->segment_count()), Skinning::cor, {}, body).ok());
    double mesh_mm3 = 0;
    for (Eigen::Index t = 0; t < model->tets.rows(); ++t) {
      const auto corner = [&](int c) { return model->nodes.row(model->tets(t, c)); };
      mesh_mm3 += tet_det(corner(0), corner(1), corner(2), corner(3)) / 6;
    }
    EXPECT_FALSE(model->volumes.empty());
    InverseMap map;
    for (const ModelVolume& volume : model->volumes) {
      const Image& rest = volume.image;
      locate(*model, body.nodes, rest.grid, map);
      const Image posed = pose_volume(model, body.nodes, volume, Sampling::nearest, rest.grid);
      const std::size_t bytes = rest.bytes.size() / rest.grid.voxels();
      std::size_t held = 0, different = 0;
      for (std::size_t v = 0; v < map.tet.size(); ++v) {
        if (map.tet[v] == InverseMap::none) continue;
        ++held;
        different +=
            !std::equal(&rest.bytes[bytes * v], &rest.bytes[bytes * v] + bytes, &posed.bytes[bytes * v]);
      }
      // No voxel was lost or invented: their volume is that of the mesh, to a voxel's rounding at the skin.
      const double voxel = rest.grid.spacing[0] * rest.grid.spacing[1] * rest.grid.spacing[2];
      const double ratio = mesh_mm3 / (static_cast<double>(held) * voxel);
      std::printf("%-24s %-10s %12zu %12zu %12zu %14.5f\n", test::short_name(path).c_str(),
                  volume.name.c_str(), map.tet.size(), held, different, ratio);
      EXPECT_EQ(different, 0u);
      EXPECT_NEAR(ratio, 1, 0.01);
    }
  }
}

}  // namespace
}  // namespace ecorche::runtime
