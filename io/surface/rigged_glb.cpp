// SPDX-License-Identifier: Apache-2.0
#include "io/surface/rigged_glb.hpp"

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"
#include "io/surface/gltf_build.hpp"
#include "io/surface/tissue_material.hpp"

namespace ecorche::io {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kMetre = 1e-3;

std::array<double, 3> place(const Vector3d& v) {
  return {kMetre * v.x(), kMetre * v.z(), -kMetre * v.y()};
}

std::vector<Vector3d> zero_points(const Clip& clip) {
  std::vector<Vector3d> out;
  for (const ClipJoint& joint : clip.joints)
    out.push_back((joint.parent < 0 ? Vector3d::Zero() : out.at(static_cast<std::size_t>(joint.parent))) +
                  joint.offset);
  return out;
}

void check(const SkinnedSurface& surface, std::size_t joints) {
  const auto vertices = static_cast<std::size_t>(surface.mesh.V.rows());
  bool whole = surface.influences.joint.size() == vertices && surface.influences.weight.size() == vertices;
  for (const auto& row : surface.influences.joint) {
    for (const std::uint16_t joint : row) whole = whole && joint < joints;
  }
  if (!whole)
    throw Error(ErrorKind::internal, "glb", "surface " + surface.name + " has no four joints a vertex",
                "report this");
}

class Builder {
 public:
  explicit Builder(const Clip& clip) : clip_(clip), model_(gltf::new_model()) {}

  tinygltf::Model& build(const std::vector<SkinnedSurface>& surfaces) {
    tinygltf::Scene scene;
    add_joints();
    scene.nodes.push_back(0);
    add_skin();
    for (const SkinnedSurface& surface : surfaces) {
      if (surface.mesh.F.rows() == 0) continue;
      check(surface, clip_.joints.size());
      scene.nodes.push_back(add_surface(surface));
    }
    if (clip_.frames() > 0) add_animation();
    model_.scenes.push_back(scene);
    model_.defaultScene = 0;
    return model_;
  }

 private:
  void add_joints() {
    for (const ClipJoint& joint : clip_.joints) {
      tinygltf::Node node;
      node.name = joint.name;
      const auto at = place(joint.offset);
      node.translation.assign(at.begin(), at.end());
      model_.nodes.push_back(node);
      if (joint.parent >= 0)
        model_.nodes[static_cast<std::size_t>(joint.parent)].children.push_back(
            static_cast<int>(model_.nodes.size()) - 1);
    }
  }

  void add_skin() {
    tinygltf::Skin skin;
    skin.skeleton = 0;
    std::vector<float> inverse;
    for (const Vector3d& point : zero_points(clip_)) {
      skin.joints.push_back(static_cast<int>(skin.joints.size()));
      const auto at = place(point);
      for (std::size_t k = 0; k < 12; ++k) inverse.push_back(k % 5 == 0 ? 1.0F : 0.0F);
      for (const double x : at) inverse.push_back(static_cast<float>(-x));
      inverse.push_back(1);
    }
    skin.inverseBindMatrices =
        gltf::add_array(model_, inverse.data(), sizeof(float) * inverse.size(), inverse.size() / 16,
                        TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_MAT4, 0);
    model_.skins.push_back(skin);
  }

  int add_surface(const SkinnedSurface& surface) {
    tinygltf::Primitive primitive = gltf::add_surface(model_, surface.mesh);
    const std::size_t count = surface.influences.joint.size();
    primitive.attributes["JOINTS_0"] = gltf::add_array(model_, surface.influences.joint.data(), 8 * count,
                                                       count, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT,
                                                       TINYGLTF_TYPE_VEC4, TINYGLTF_TARGET_ARRAY_BUFFER);
    primitive.attributes["WEIGHTS_0"] =
        gltf::add_array(model_, surface.influences.weight.data(), 16 * count, count,
                        TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC4, TINYGLTF_TARGET_ARRAY_BUFFER);
    primitive.material = gltf::add_material(model_, surface.name, surface.group);
    tinygltf::Mesh mesh;
    mesh.name = name_of(surface);
    mesh.primitives.push_back(primitive);
    model_.meshes.push_back(mesh);
    tinygltf::Node node;
    node.name = model_.meshes.back().name;
    node.mesh = static_cast<int>(model_.meshes.size()) - 1;
    node.skin = 0;
    model_.nodes.push_back(node);
    return static_cast<int>(model_.nodes.size()) - 1;
  }

  // Names of nodes are unique: readers rename the second, and motions are matched by those of joints.
  std::string name_of(const SkinnedSurface& surface) const {
    for (const ClipJoint& joint : clip_.joints) {
      if (joint.name == surface.name) return surface.name + "_" + std::string(group_name(surface.group));
    }
    return surface.name;
  }

  int add_floats(const std::vector<float>& values, int type, std::size_t width) {
    return gltf::add_array(model_, values.data(), sizeof(float) * values.size(), values.size() / width,
                           TINYGLTF_COMPONENT_TYPE_FLOAT, type, 0);
  }

  void add_animation() {
    tinygltf::Animation animation;
    animation.name = clip_.name;
    std::vector<float> times, way;
    for (std::size_t f = 0; f < clip_.frames(); ++f) {
      times.push_back(static_cast<float>(static_cast<double>(f) * clip_.frame_seconds));
      for (const double x : place(clip_.root_position[f])) way.push_back(static_cast<float>(x));
    }
    const int input = add_floats(times, TINYGLTF_TYPE_SCALAR, 1);
    model_.accessors.back().minValues = {static_cast<double>(times.front())};
    model_.accessors.back().maxValues = {static_cast<double>(times.back())};
    add_channel(animation, input, add_floats(way, TINYGLTF_TYPE_VEC3, 3), 0, "translation");
    const std::size_t joints = clip_.joints.size();
    for (std::size_t j = 0; j < joints; ++j) {
      std::vector<float> turns;
      Quaterniond before = Quaterniond::Identity();
      for (std::size_t f = 0; f < clip_.frames(); ++f) {
        Quaterniond q = clip_.rotation[f * joints + j];
        if (q.dot(before) < 0)
          q.coeffs() = -q.coeffs();  // the shorter way, also for readers that do not look
        before = q;
        for (const double x : {q.x(), q.z(), -q.y(), q.w()}) turns.push_back(static_cast<float>(x));
      }
      add_channel(animation, input, add_floats(turns, TINYGLTF_TYPE_VEC4, 4), static_cast<int>(j),
                  "rotation");
    }
    model_.animations.push_back(animation);
  }

  static void add_channel(tinygltf::Animation& animation, int input, int output, int node, const char* path) {
    tinygltf::AnimationSampler sampler;
    sampler.input = input;
    sampler.output = output;
    sampler.interpolation = "LINEAR";
    animation.samplers.push_back(sampler);
    tinygltf::AnimationChannel channel;
    channel.sampler = static_cast<int>(animation.samplers.size()) - 1;
    channel.target_node = node;
    channel.target_path = path;
    animation.channels.push_back(channel);
  }

  const Clip& clip_;
  tinygltf::Model model_;
};

}  // namespace

void write_rigged_glb(const std::filesystem::path& path, const Clip& clip,
                      const std::vector<SkinnedSurface>& surfaces) {
  if (clip.joints.empty() || clip.rotation.size() != clip.frames() * clip.joints.size())
    throw Error(ErrorKind::internal, path.string(), "the clip's joints and frames do not fit together",
                "report this");
  files::AtomicFile file(path);
  Builder builder(clip);
  gltf::write_file(builder.build(surfaces), file.temporary());
  file.commit();
}

}  // namespace ecorche::io
