// SPDX-License-Identifier: Apache-2.0
#include "io/surface/gltf.hpp"

#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstring>

#include "core/files/atomic_file.hpp"
#include "io/surface/byte_reader.hpp"
#include "io/surface/gltf_accessor.hpp"
#include "io/surface/mesh_builder.hpp"

namespace ecorche::io::gltf {
namespace {

using bytes::refuse;

constexpr int kDeepestJson = 64, kDeepestNodes = 256;
constexpr std::size_t kLargestBuffer = std::size_t{1} << 32;

// tinygltf descends into nested values by recursion.
void check_depth(std::string_view json, const std::string& where) {
  int depth = 0;
  bool text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (text) {
      if (c == '\\') ++i;
      if (c == '"') text = false;
    } else if (c == '"') {
      text = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kDeepestJson) refuse(where, "its JSON is nested more than 64 deep");
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
}

// The JSON chunk of a GLB; lengths are held against the file.
std::string_view json_of_glb(std::string_view file, const std::string& where) {
  const auto word = [&](std::size_t at) { return bytes::load<std::uint32_t>(file.data() + at, false); };
  if (file.size() < 20 || file.substr(0, 4) != "glTF")
    refuse(where, "is no GLB: it does not begin with 'glTF'");
  if (word(4) != 2) refuse(where, "is of glTF version " + std::to_string(word(4)), "save it as glTF 2.0");
  if (word(8) != file.size())
    refuse(where, "says " + std::to_string(word(8)) + " bytes, but has " + std::to_string(file.size()));
  const std::uint64_t length = word(12);
  if (file.substr(16, 4) != "JSON" || length > file.size() - 20) refuse(where, "its JSON chunk is damaged");
  if (length % 4 != 0) refuse(where, "its JSON chunk is not padded to 4 bytes");
  return file.substr(20, length);
}

// Only plainly named files beside the glTF, and no pictures: anything else could read any file of the
// machine.
bool is_plain(const std::filesystem::path& name) {
  const std::string ending = bytes::lower(name.extension().string());
  return !name.empty() && !name.has_parent_path() && name != "." && name != ".." && ending != ".png" &&
         ending != ".jpg" && ending != ".jpeg" && ending != ".webp" && ending != ".ktx2" && ending != ".dds";
}

tinygltf::Model parse(std::string_view file, const std::filesystem::path& path) {
  const std::string where = path.string();
  const bool binary = bytes::lower(path.extension().string()) == ".glb";
  const std::string_view json = binary ? json_of_glb(file, where) : file;
  if (!binary && !bytes::trim(json).starts_with('{')) refuse(where, "is no glTF: it is no JSON object");
  check_depth(json, where);
  if (file.size() > std::numeric_limits<std::uint32_t>::max()) refuse(where, "is larger than glTF can be");
  tinygltf::TinyGLTF reader;
  reader.SetImageLoader([](tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*,
                           int, void*) { return true; },
                        nullptr);
  const std::filesystem::path folder = path.parent_path();
  tinygltf::FsCallbacks files{};
  files.FileExists = [](const std::string& name, void* base) {
    return is_plain(name) &&
           std::filesystem::is_regular_file(*static_cast<std::filesystem::path*>(base) / name);
  };
  files.ExpandFilePath = [](const std::string& name, void*) { return name; };
  files.ReadWholeFile = [](std::vector<unsigned char>* out, std::string* problem, const std::string& name,
                           void* base) {
    try {
      if (!is_plain(name)) return false;
      const std::string read =
          files::read_text(*static_cast<std::filesystem::path*>(base) / name, kLargestBuffer);
      out->assign(read.begin(), read.end());
      return true;
    } catch (const Error& error) {
      *problem += error.what();
      return false;
    }
  };
  files.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
    return false;
  };
  files.user_data = const_cast<std::filesystem::path*>(&folder);
  reader.SetFsCallbacks(files);
  tinygltf::Model model;
  std::string problem, warning;
  const auto size = static_cast<unsigned>(file.size());
  const bool read =
      binary ? reader.LoadBinaryFromMemory(&model, &problem, &warning,
                                           reinterpret_cast<const unsigned char*>(file.data()), size)
             : reader.LoadASCIIFromString(&model, &problem, &warning, file.data(), size, "");
  if (!read) {
    std::replace(problem.begin(), problem.end(), '\n', ' ');
    refuse(where, "is no glTF 2.0: " + std::string(bytes::trim(problem).substr(0, 300)));
  }
  for (const std::string& extension : model.extensionsRequired) {
    const bool harmless = extension == "KHR_mesh_quantization" || extension.starts_with("KHR_materials_") ||
                          extension.starts_with("KHR_texture_") || extension.starts_with("KHR_lights_") ||
                          extension.starts_with("EXT_texture_");
    if (!harmless) refuse(where, "requires " + extension.substr(0, 80), "save it without that extension");
  }
  return model;
}

Eigen::Affine3d local_transform(const tinygltf::Node& node, const std::string& where) {
  Eigen::Affine3d out = Eigen::Affine3d::Identity();
  const auto given = [&](const std::vector<double>& values, std::size_t size) {
    if (!values.empty() && values.size() != size) refuse(where, "a node's transform is damaged");
    return !values.empty();
  };
  if (given(node.matrix, 16)) {
    const Eigen::Map<const Eigen::Matrix4d> matrix(node.matrix.data());  // column-major, as glTF is
    if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) refuse(where, "a node's matrix is not affine");
    out.matrix() = matrix;
  }
  if (given(node.translation, 3)) out.translate(Eigen::Vector3d(node.translation.data()));
  if (given(node.rotation, 4)) {
    const Eigen::Quaterniond q(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
    if (!(q.norm() > 1e-6)) refuse(where, "a node's rotation is no quaternion");
    out.rotate(q.normalized());
  }
  if (given(node.scale, 3)) out.scale(Eigen::Vector3d(node.scale.data()));
  return out;
}

class SceneReader {
 public:
  SceneReader(const tinygltf::Model& model, const std::string& where)
      : model_(model), where_(where), mesh_(where) {}

  SurfaceMesh read() {
    for (const int root : roots()) place(root, Eigen::Affine3d::Identity(), 0);
    for (const auto& [number, global] : order_) {
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
  std::vector<int> roots() const {
    if (!model_.scenes.empty()) {
      const auto scene = static_cast<std::size_t>(std::max(model_.defaultScene, 0));
      if (scene >= model_.scenes.size())
        refuse(where_,
               "names scene " + std::to_string(scene) + " of " + std::to_string(model_.scenes.size()));
      return model_.scenes[scene].nodes;
    }
    std::vector<char> is_child(model_.nodes.size(), 0);
    for (const tinygltf::Node& node : model_.nodes) {
      for (const int child : node.children) {
        if (child >= 0 && static_cast<std::size_t>(child) < is_child.size())
          is_child[static_cast<std::size_t>(child)] = 1;
      }
    }
    std::vector<int> out;
    for (std::size_t n = 0; n < is_child.size(); ++n) {
      if (is_child[n] == 0) out.push_back(static_cast<int>(n));
    }
    return out;
  }

  // Depth first; a node that is met twice would be a cycle, or two parents.
  void place(int number, const Eigen::Affine3d& parent, int depth) {
    if (number < 0 || static_cast<std::size_t>(number) >= model_.nodes.size())
      refuse(where_, "names node " + std::to_string(number) + " of " + std::to_string(model_.nodes.size()));
    const auto row = static_cast<std::size_t>(number);
    global_.resize(model_.nodes.size());
    if (global_[row] || depth > kDeepestNodes) refuse(where_, "its nodes are no tree");
    global_[row] = parent * local_transform(model_.nodes[row], where_);
    order_.emplace_back(row, *global_[row]);
    for (const int child : model_.nodes[row].children) place(child, *global_[row], depth + 1);
  }

  // Where each point of a skinned primitive stands in the rest pose of the skin's joints.
  std::vector<Eigen::Affine3d> joint_matrices(int number) const {
    if (static_cast<std::size_t>(number) >= model_.skins.size())
      refuse(where_, "a node names a skin that is not there");
    const tinygltf::Skin& skin = model_.skins[static_cast<std::size_t>(number)];
    std::vector<Eigen::Affine3d> out;
    std::vector<double> binds;
    if (skin.inverseBindMatrices >= 0) {
      binds = reals(model_, skin.inverseBindMatrices, 16, where_);
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
    const std::vector<double> x = reals(model_, attribute("POSITION"), 3, where_);
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
      const std::vector<double> joints = reals(model_, attribute("JOINTS_" + std::to_string(set)), 4, where_);
      const std::vector<double> weights =
          reals(model_, attribute("WEIGHTS_" + std::to_string(set)), 4, where_);
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
      corners = wholes(model_, primitive.indices, where_);
    } else {
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
  MeshBuilder mesh_;
  std::vector<std::optional<Eigen::Affine3d>> global_;
  std::vector<std::pair<std::size_t, Eigen::Affine3d>> order_;
};

}  // namespace

SurfaceMesh decode(std::string_view file, const std::filesystem::path& path) {
  const tinygltf::Model model = parse(file, path);
  const std::string where = path.string();
  return SceneReader(model, where).read();
}

}  // namespace ecorche::io::gltf
