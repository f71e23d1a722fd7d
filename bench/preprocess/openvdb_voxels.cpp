// SPDX-License-Identifier: Apache-2.0
#include "bench/preprocess/peers.hpp"

#ifdef BENCH_OPENVDB
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <chrono>
#endif

namespace ecorche::bench {

#ifdef BENCH_OPENVDB
PeerRun openvdb_voxelize(const Case& patient, double voxel_mm) {
  openvdb::initialize();
  std::vector<const SurfaceMesh*> surfaces{&patient.skin};
  for (const CaseBone& bone : patient.bones) surfaces.push_back(&bone.surface);
  struct Soup {
    std::vector<openvdb::Vec3s> V;
    std::vector<openvdb::Vec3I> F;
  };
  std::vector<Soup> soups;
  for (const SurfaceMesh* surface : surfaces) {
    Soup& soup = soups.emplace_back();
    for (Eigen::Index v = 0; v < surface->V.rows(); ++v) {
      const Eigen::RowVector3f p = surface->V.row(v).cast<float>() / static_cast<float>(voxel_mm);
      soup.V.emplace_back(p[0], p[1], p[2]);
    }
    for (Eigen::Index f = 0; f < surface->F.rows(); ++f) {
      soup.F.emplace_back(static_cast<unsigned>(surface->F(f, 0)), static_cast<unsigned>(surface->F(f, 1)),
                          static_cast<unsigned>(surface->F(f, 2)));
    }
  }
  PeerRun run{std::string("OpenVDB ") + OPENVDB_LIBRARY_VERSION_STRING};
  const auto start = std::chrono::steady_clock::now();
  std::uint64_t active = 0;
  for (const Soup& soup : soups) {
    const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> mesh(soup.V, soup.F);
    // The sign within, as a label needs it: the interior is kept up to its middle.
    const auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(mesh, openvdb::math::Transform(), 1.0F,
                                                                       std::numeric_limits<float>::max());
    active += grid->activeVoxelCount();
  }
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  run.did = std::to_string(active) + " voxels with a distance";
  return run;
}
#else
PeerRun openvdb_voxelize(const Case&, double) {
  return {};
}
#endif

}  // namespace ecorche::bench
