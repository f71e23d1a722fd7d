// SPDX-License-Identifier: Apache-2.0
#include "io/surface/gltf.hpp"

#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstring>

#include "io/surface/byte_reader.hpp"
#include "io/surface/gltf_accessor.hpp"
#include "io/surface/gltf_model.hpp"
#include "io/surface/mesh_builder.hpp"

namespace ecorche::io::gltf {
namespace {

using bytes::refuse;

class SceneReader {
 public:
  SceneReader(const tinygltf::Model& model, files::Budget& budget)
      : model_(model), where_(budget.where()), budget_(budget), mesh_(budget) {}

  SurfaceMesh read() {
    global_.resize(model_.nodes.size());
    const std::vector<PlacedNode> nodes = place_nodes(model_, where_);
    for (const PlacedNode& node : nodes) global_[node.number] = node.global;
    for (const auto& [number, parent, global] : nodes) {
      const tinygltf::Node& node = model_.nodes[number];
      if (node.mesh < 0) continue;
      if (static_cast<std::size_t>(node.mesh) >= model_.meshes.size())
        refuse(where_, "a node names mesh " + std::to_string(node.mesh) + " of " +
                           std::to_string(model_.meshes.size()));
      for (const tinygltf::Primitive& primitive :
           model_.meshes[static_cast<std::size_t>(node.mesh)].primitives)
        add_primitive(primitive, node, global);
    }
    return mesh_.finish();
  }

 private:
  // Where each point of a skinned primitive stands in the rest pose of the skin's joints.
  std::vector<Eigen::Affine3d> joint_matrices(int number) const {
    if (static_cast<std::size_t>(number) >= model_.skins.size())
      refuse(where_, "a node names a skin that is not there");
    const tinygltf::Skin& skin = model_.skins[static_cast<std::size_t>(number)];
    std::vector<Eigen::Affine3d> out;
    std::vector<double> binds;
    budget_.spend(skin.joints.size(), 2 * sizeof(Eigen::Affine3d));
    if (skin.inverseBindMatrices >= 0) {
      binds = reals(model_, skin.inverseBindMatrices, 16, budget_);
      if (binds.size() < 16 * skin.joints.size()) refuse(where_, "a skin has fewer matrices than joints");
    }
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      const auto joint = static_cast<std::size_t>(skin.joints[j]);
      if (skin.joints[j] < 0 || joint >= global_.size() || !global_[joint])
        refuse(where_, "a joint of its skin is not in the scene");
      Eigen::Affine3d bind = Eigen::Affine3d::Identity();
      if (!binds.empty())
        bind.matrix().topRows<3>() = Eigen::Map<const Eigen::Matrix4d>(binds.data() + 16 * j).topRows<3>();
      out.push_back(*global_[joint] * bind);
    }
    return out;
  }

  std::vector<Eigen::Vector3d> points_of(const tinygltf::Primitive& primitive, const tinygltf::Node& node,
                                         const Eigen::Affine3d& global) const {
    const auto attribute = [&](const std::string& name) {
      const auto found = primitive.attributes.find(name);
      return found == primitive.attributes.end() ? -1 : found->second;
    };
    const std::vector<double> x = reals(model_, attribute("POSITION"), 3, budget_);
    budget_.spend(x.size() / 3, 2 * sizeof(Eigen::Vector3d) + sizeof(double));
    std::vector<Eigen::Vector3d> out(x.size() / 3);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = Eigen::Vector3d(x.data() + 3 * i);
    if (node.skin < 0 || attribute("JOINTS_0") < 0 || attribute("WEIGHTS_0") < 0) {
      for (Eigen::Vector3d& p : out) p = global * p;
      return out;
    }
    const std::vector<Eigen::Affine3d> matrices = joint_matrices(node.skin);
    std::vector<Eigen::Vector3d> moved(out.size(), Eigen::Vector3d::Zero());
    std::vector<double> total(out.size(), 0);
    for (int set = 0; attribute("JOINTS_" + std::to_string(set)) >= 0; ++set) {
      const std::vector<double> joints =
          reals(model_, attribute("JOINTS_" + std::to_string(set)), 4, budget_);
      const std::vector<double> weights =
          reals(model_, attribute("WEIGHTS_" + std::to_string(set)), 4, budget_);
      if (joints.size() != 4 * out.size() || weights.size() != joints.size())
        refuse(where_, "its weights are not as many as its points");
      for (std::size_t i = 0; i < joints.size(); ++i) {
        if (!(joints[i] >= 0) || joints[i] >= static_cast<double>(matrices.size()))
          refuse(where_, "a weight names a joint that is not there");
        moved[i / 4] += weights[i] * (matrices[static_cast<std::size_t>(joints[i])] * out[i / 4]);
        total[i / 4] += weights[i];
      }
    }
    // Weights of published files do not always sum to one.
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = total[i] > 0 ? Eigen::Vector3d(moved[i] / total[i]) : global * out[i];
    return out;
  }

  void add_primitive(const tinygltf::Primitive& primitive, const tinygltf::Node& node,
                     const Eigen::Affine3d& global) {
    const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
    if (mode < TINYGLTF_MODE_TRIANGLES) return;  // points and lines
    const auto base = static_cast<std::int64_t>(mesh_.points());
    const std::vector<Eigen::Vector3d> points = points_of(primitive, node, global);
    for (const Eigen::Vector3d& p : points) mesh_.add_point({p.x(), p.y(), p.z()});
    std::vector<std::int64_t> corners;
    if (primitive.indices >= 0) {
      corners = wholes(model_, primitive.indices, budget_);
    } else {
      budget_.spend(points.size(), 2 * sizeof corners[0]);  // with room to grow
      for (std::size_t i = 0; i < points.size(); ++i) corners.push_back(static_cast<std::int64_t>(i));
    }
    for (std::int64_t& c : corners) {
      if (c < 0 || static_cast<std::size_t>(c) >= points.size())
        refuse(where_,
               "an index is " + std::to_string(c) + ", of " + std::to_string(points.size()) + " points");
      c += base;
    }
    const bool mirrored = node.skin < 0 && global.linear().determinant() < 0;
    if (mode == TINYGLTF_MODE_TRIANGLES) {
      if (corners.size() % 3 != 0)
        refuse(where_, std::to_string(corners.size()) + " corners make no triangles");
      for (std::size_t i = 0; i < corners.size(); i += 3) {
        if (mirrored) std::swap(corners[i + 1], corners[i + 2]);
        mesh_.add_polygon(std::span(corners).subspan(i, 3));
      }
    } else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
      // The first corner twice: every triangle of the strip turns round.
      if (mirrored && !corners.empty()) corners.insert(corners.begin(), corners.front());
      mesh_.add_strip(corners);
    } else if (mode == TINYGLTF_MODE_TRIANGLE_FAN) {
      if (mirrored && !corners.empty()) std::reverse(corners.begin() + 1, corners.end());
      mesh_.add_fan(corners);
    } else {
      refuse(where_, "a primitive is of mode " + std::to_string(mode));
    }
  }

  const tinygltf::Model& model_;
  const std::string& where_;
  files::Budget& budget_;
  MeshBuilder mesh_;
  std::vector<std::optional<Eigen::Affine3d>> global_;
};

}  // namespace

SurfaceMesh decode(std::string_view file, const std::filesystem::path& path,
                   const files::ReadLimits& limits) {
  files::Budget budget(file.size(), limits, path.string());
  const tinygltf::Model model = parse(file, path, budget);
  return SceneReader(model, budget).read();
}

}  // namespace ecorche::io::gltf
