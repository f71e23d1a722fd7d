// SPDX-License-Identifier: Apache-2.0
#include "io/surface/glb.hpp"

#include "io/surface/gltf_build.hpp"
#include "io/surface/tissue_material.hpp"

namespace ecorche::io {

void write_glb(const std::filesystem::path& path, std::span<const NamedSurface> surfaces) {
  tinygltf::Model gltf = gltf::new_model();
  tinygltf::Scene scene;
  for (const NamedSurface& surface : surfaces) {
    if (surface.mesh.F.rows() == 0) continue;
    tinygltf::Mesh mesh;
    mesh.name = surface.name;
    mesh.primitives.push_back(gltf::add_surface(gltf, surface.mesh));
    mesh.primitives.back().material = gltf::add_material(gltf, surface.name, surface.group);
    gltf.meshes.push_back(std::move(mesh));
    tinygltf::Node node;
    node.name = surface.name;
    node.mesh = static_cast<int>(gltf.meshes.size()) - 1;
    gltf.nodes.push_back(std::move(node));
    scene.nodes.push_back(static_cast<int>(gltf.nodes.size()) - 1);
  }
  gltf.scenes.push_back(scene);
  gltf.defaultScene = 0;
  gltf::write_file(gltf, path);
}

}  // namespace ecorche::io
