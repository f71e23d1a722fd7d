// SPDX-License-Identifier: Apache-2.0
#include "io/surface/glb.hpp"

#include "io/surface/gltf_build.hpp"

namespace ecorche::io {

void write_glb(const std::filesystem::path& path, const SurfaceMesh& mesh) {
  tinygltf::Model gltf = gltf::new_model();
  tinygltf::Mesh out;
  out.primitives.push_back(gltf::add_surface(gltf, mesh));
  gltf.meshes.push_back(out);
  tinygltf::Node node;
  node.mesh = 0;
  gltf.nodes.push_back(node);
  tinygltf::Scene scene;
  scene.nodes.push_back(0);
  gltf.scenes.push_back(scene);
  gltf.defaultScene = 0;
  gltf::write_file(gltf, path);
}

}  // namespace ecorche::io
