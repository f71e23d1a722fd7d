// SPDX-License-Identifier: Apache-2.0
#include "io/surface/gltf_model.hpp"

#include <algorithm>
#include <limits>
#include <optional>

#include "core/files/atomic_file.hpp"
#include "core/files/look.hpp"
#include "core/values/text.hpp"
#include "io/surface/byte_reader.hpp"

namespace ecorche::io::gltf {
namespace {

using bytes::refuse;

constexpr int kDeepestJson = 64, kDeepestNodes = 256;
constexpr std::size_t kLargestBuffer = std::size_t{1} << 32;

// What tinygltf makes of an object; and of what stands between two commas, as JSON and as a number of a
// vector.
constexpr std::uint64_t kObject = 2560, kValue = 100;
static_assert(sizeof(tinygltf::Node) < kObject && sizeof(tinygltf::Material) < kObject &&
              sizeof(tinygltf::Accessor) < kObject && sizeof(tinygltf::Primitive) < kObject);

// tinygltf descends into nested values by recursion, and builds a value of its own for every object.
void check_json(std::string_view json, files::Budget& budget) {
  const std::string& where = budget.where();
  int depth = 0;
  bool text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (text) {
      if (c == '\\') ++i;
      if (c == '"') text = false;
    } else if (c == '"') {
      text = true;
    } else if (c == ',') {
      budget.spend(kValue);
    } else if (c == '{' || c == '[') {
      budget.spend(c == '{' ? kObject : kValue);
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
  const std::string ending = text::lower(name.extension().string());
  return !name.empty() && !name.has_parent_path() && name != "." && name != ".." && ending != ".png" &&
         ending != ".jpg" && ending != ".jpeg" && ending != ".webp" && ending != ".ktx2" && ending != ".dds";
}

std::vector<int> roots(const tinygltf::Model& model, const std::string& where) {
  if (!model.scenes.empty()) {
    const auto scene = static_cast<std::size_t>(std::max(model.defaultScene, 0));
    if (scene >= model.scenes.size())
      refuse(where, "names scene " + std::to_string(scene) + " of " + std::to_string(model.scenes.size()));
    return model.scenes[scene].nodes;
  }
  std::vector<char> is_child(model.nodes.size(), 0);
  for (const tinygltf::Node& node : model.nodes) {
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

class Placer {
 public:
  Placer(const tinygltf::Model& model, const std::string& where)
      : model_(model), where_(where), met_(model.nodes.size(), 0) {}

  // Depth first; a node that is met twice would be a cycle, or two parents.
  void place(int number, int parent, const Eigen::Affine3d& above, int depth) {
    if (number < 0 || static_cast<std::size_t>(number) >= model_.nodes.size())
      refuse(where_, "names node " + std::to_string(number) + " of " + std::to_string(model_.nodes.size()));
    const auto row = static_cast<std::size_t>(number);
    if (met_[row] != 0 || depth > kDeepestNodes) refuse(where_, "its nodes are no tree");
    met_[row] = 1;
    const Eigen::Affine3d global = above * local_transform(model_.nodes[row], where_);
    out.push_back({row, parent, global});
    const int self = static_cast<int>(out.size()) - 1;
    for (const int child : model_.nodes[row].children) place(child, self, global, depth + 1);
  }

  std::vector<PlacedNode> out;

 private:
  const tinygltf::Model& model_;
  const std::string& where_;
  std::vector<char> met_;
};

}  // namespace

tinygltf::Model parse(std::string_view file, const std::filesystem::path& path, files::Budget& budget) {
  const std::string& where = budget.where();
  const bool binary = text::lower(path.extension().string()) == ".glb";
  if (file.size() > std::numeric_limits<std::uint32_t>::max()) refuse(where, "is larger than glTF can be");
  const std::string_view json = binary ? json_of_glb(file, where) : file;
  if (!binary && !text::trim(json).starts_with('{')) refuse(where, "is no glTF: it is no JSON object");
  check_json(json, budget);
  tinygltf::TinyGLTF reader;
  reader.SetImageLoader([](tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*,
                           int, void*) { return true; },
                        nullptr);
  struct FolderFiles {
    std::filesystem::path folder;
    files::Budget& budget;
  } folder_files{path.parent_path(), budget};
  tinygltf::FsCallbacks files{};
  files.FileExists = [](const std::string& name, void* base) {
    return is_plain(name) && files::is_file(static_cast<FolderFiles*>(base)->folder / name);
  };
  files.ExpandFilePath = [](const std::string& name, void*) { return name; };
  files.ReadWholeFile = [](std::vector<unsigned char>* out, std::string* problem, const std::string& name,
                           void* base) {
    try {
      if (!is_plain(name)) return false;
      const std::string read =
          files::read_text(static_cast<FolderFiles*>(base)->folder / name, kLargestBuffer);
      static_cast<FolderFiles*>(base)->budget.add_file(read.size());
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
  files.user_data = &folder_files;
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
    refuse(where, "is no glTF 2.0: " + std::string(text::trim(problem).substr(0, 300)));
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

std::vector<PlacedNode> place_nodes(const tinygltf::Model& model, const std::string& where) {
  Placer placer(model, where);
  for (const int root : roots(model, where)) placer.place(root, -1, Eigen::Affine3d::Identity(), 0);
  return std::move(placer.out);
}

}  // namespace ecorche::io::gltf
