// SPDX-License-Identifier: Apache-2.0
// glTF made by hand: node trees, modes, accessors; assimp is the second opinion.
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "io/surface/gltf_build.hpp"
#include "io/surface/surface_file.hpp"
#include "tests/unit/io/foreign_surfaces.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/soups.hpp"

namespace ecorche::io {
namespace {

using nlohmann::json;

template <class T>
void append(std::string& bytes, const std::vector<T>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  bytes.resize((bytes.size() + 3) / 4 * 4, '\0');
}

// Five points; a triangle list, a strip and a fan over them; the points again as normalized shorts.
struct Parts {
  std::string bytes;
  json gltf;

  Parts() {
    gltf = {{"asset", {{"version", "2.0"}}}, {"bufferViews", json::array()}, {"accessors", json::array()}};
    add<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0.5F, 2, 0.25F}, 5126, "VEC3", 5);  // 0
    add<std::uint16_t>({0, 1, 2, 2, 1, 3}, 5123, "SCALAR", 6);                          // 1
    add<std::uint8_t>({0, 1, 2, 3, 4}, 5121, "SCALAR", 5);                              // 2
    add<std::uint32_t>({0, 1, 3, 2}, 5125, "SCALAR", 4);                                // 3
    add<std::int16_t>({0, 0, 0, 0, 32767, 0, 0, 0, 0, 32767, 0, 0}, 5122, "VEC3", 3);   // 4: rows of 8 bytes
    gltf["accessors"][4]["normalized"] = true;
    gltf["bufferViews"][4]["byteStride"] = 8;
    gltf["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}},
                      {{"primitives",
                        {{{"attributes", {{"POSITION", 0}}}, {"indices", 2}, {"mode", 5}},
                         {{"attributes", {{"POSITION", 0}}}, {"indices", 3}, {"mode", 6}},
                         {{"attributes", {{"POSITION", 0}}}, {"mode", 0}}}}}};
    gltf["nodes"] = {{{"mesh", 0}}};
    gltf["scenes"] = {{{"nodes", {0}}}};
    gltf["scene"] = 0;
  }

  template <class T>
  void add(const std::vector<T>& values, int component, const char* type, int count) {
    const std::size_t at = bytes.size();
    append(bytes, values);
    gltf["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", at}, {"byteLength", bytes.size() - at}});
    json accessor{{"bufferView", gltf["bufferViews"].size() - 1},
                  {"componentType", component},
                  {"count", count},
                  {"type", type}};
    if (gltf["accessors"].empty()) {
      accessor["min"] = {0, 0, 0};
      accessor["max"] = {1, 2, 0.25};
    }
    gltf["accessors"].push_back(accessor);
  }

  std::string glb() const {
    json whole = gltf;
    whole["buffers"] = {{{"byteLength", bytes.size()}}};
    std::string text = whole.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const auto words = [](std::vector<std::uint32_t> values) {
      std::string out;
      append(out, values);
      return out;
    };
    const auto size = [](std::size_t n) { return static_cast<std::uint32_t>(n); };
    return words({0x46546C67, 2, size(28 + text.size() + bytes.size()), size(text.size()), 0x4E4F534A}) +
           text + words({size(bytes.size()), 0x004E4942}) + bytes;
  }
};

SurfaceMesh read_glb(const Scratch& scratch, const Parts& parts) {
  return read_surface(scratch.put("a.glb", parts.glb()));
}

TEST(Gltf, TransformsAreComposedDownTheTree) {
  const Scratch scratch;
  Parts parts;
  parts.gltf["nodes"] = {{{"children", {1, 2}}, {"translation", {10, 0, 0}}, {"scale", {2, 2, 2}}},
                         {{"mesh", 0}, {"rotation", {0, 0, 1, 0}}},  // half a turn about z
                         {{"children", {3}}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 4, 1}}},
                         {{"mesh", 1}, {"translation", {0, 0, 1}}},
                         {{"mesh", 0}, {"translation", {99, 0, 0}}}};  // in no scene
  const SurfaceMesh mesh = read_glb(scratch, parts);
  EXPECT_EQ(mesh.F.rows(), 2 + 3 + 2);
  // Point (1, 0, 0) turned, doubled and moved.
  EXPECT_EQ(mesh.V.row(1), Eigen::RowVector3d(8, 0, 0));
  // z of the mirrored node: 2 * (4 - (0 + 1)), and 2 * (4 - 1.25)
  EXPECT_DOUBLE_EQ(mesh.V.col(2).maxCoeff(), 6);
  // assimp does not turn mirrored triangles: compared without their turn.
  const auto corners = [](const SurfaceMesh& surface) {
    auto rows = soup(surface);
    for (auto& row : rows) {
      std::array<std::array<float, 3>, 3> points{};
      std::memcpy(points.data(), row.data(), sizeof row);
      std::sort(points.begin(), points.end());
      std::memcpy(row.data(), points.data(), sizeof row);
    }
    std::sort(rows.begin(), rows.end());
    return rows;
  };
  EXPECT_EQ(corners(mesh), corners(foreign::assimp_surface(scratch / "a.glb")));
}

TEST(Gltf, AFolderThatIsNotThereIsNamed) {
  tinygltf::Model model = gltf::new_model();
  expect_error(ErrorKind::io, "none/a.glb: glTF could not be written (check the disk's free space)",
               [&] { gltf::write_file(model, Scratch() / "none" / "a.glb"); });
}

TEST(Gltf, MirroredNodesKeepFacingOutward) {
  const Scratch scratch;
  for (const int mesh_number : {0, 1}) {
    Parts parts;
    parts.gltf["nodes"] = {{{"mesh", mesh_number}}};
    const SurfaceMesh plain = read_glb(scratch, parts);
    parts.gltf["nodes"] = {{{"mesh", mesh_number}, {"scale", {-1, 1, 1}}}};
    SurfaceMesh mirrored = read_glb(scratch, parts);
    mirrored.V.col(0) *= -1;
    mirrored.F.col(1).swap(mirrored.F.col(2));
    EXPECT_EQ(soup(mirrored), soup(plain));
  }
}

TEST(Gltf, StripsFansAndListsAreThoseOfAssimp) {
  const Scratch scratch;
  Parts parts;
  parts.gltf["nodes"] = {{{"mesh", 1}}};
  const SurfaceMesh mesh = read_glb(scratch, parts);
  EXPECT_EQ(soup(mesh), soup(foreign::assimp_surface(scratch / "a.glb")));
  parts.gltf["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", 4}}}}}}}};  // no indices; quantized
  parts.gltf["extensionsRequired"] = {"KHR_mesh_quantization"};
  parts.gltf["extensionsUsed"] = {"KHR_mesh_quantization"};
  parts.gltf["nodes"] = {{{"mesh", 0}}};
  const SurfaceMesh small = read_glb(scratch, parts);
  ASSERT_EQ(small.V.rows(), 3);
  EXPECT_EQ(small.V.row(1), Eigen::RowVector3d(1, 0, 0));
  EXPECT_EQ(small.V.row(2), Eigen::RowVector3d(0, 1, 0));
}

TEST(Gltf, SparseAccessorsAreWrittenOver) {
  const Scratch scratch;
  Parts parts;
  parts.add<float>({7, 8, 9}, 5126, "VEC3", 1);     // 5
  parts.add<std::uint8_t>({2}, 5121, "SCALAR", 1);  // 6
  parts.gltf["accessors"][0]["sparse"] = {{"count", 1},
                                          {"indices", {{"bufferView", 6}, {"componentType", 5121}}},
                                          {"values", {{"bufferView", 5}}}};
  EXPECT_EQ(read_glb(scratch, parts).V.row(2), Eigen::RowVector3d(7, 8, 9));
}

TEST(Gltf, BuffersLieBesideItOrInIt) {
  const Scratch scratch;
  Parts parts;
  scratch.put("points.bin", parts.bytes);
  parts.gltf["buffers"] = {{{"byteLength", parts.bytes.size()}, {"uri", "points.bin"}}};
  EXPECT_EQ(read_surface(scratch.put("a.gltf", parts.gltf.dump())).F.rows(), 2);
  for (const char* name : {"../points.bin", "/etc/hostname", "sub/points.bin", "none.bin"}) {
    parts.gltf["buffers"][0]["uri"] = name;
    expect_error(ErrorKind::data, "a.gltf: is no glTF 2.0",
                 [&] { read_surface(scratch.put("a.gltf", parts.gltf.dump())); });
  }
}

// Its first mesh on a skin of two joints.
Parts skinned() {
  Parts parts;
  parts.add<std::uint8_t>({0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}, 5121, "VEC4",
                          5);                                                                           // 5
  parts.add<float>({1, 0, 0, 0, 1, 0, 0, 0, 0.25F, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0}, 5126, "VEC4", 5);  // 6
  parts.gltf["meshes"][0]["primitives"][0]["attributes"] = {
      {"POSITION", 0}, {"JOINTS_0", 5}, {"WEIGHTS_0", 6}};
  parts.gltf["skins"] = {{{"joints", {1, 2}}}};
  parts.gltf["nodes"] = {
      {{"mesh", 0}, {"skin", 0}, {"translation", {50, 50, 50}}},  // which a skin makes void
      {{"translation", {10, 0, 0}}},
      {{"translation", {0, 20, 0}}}};
  parts.gltf["scenes"] = {{{"nodes", {0, 1, 2}}}};
  return parts;
}

TEST(Gltf, SkinnedNodesStandInTheirRestPose) {
  const Scratch scratch;
  const SurfaceMesh mesh = read_glb(scratch, skinned());
  Points expected(4, 3);
  expected << 10, 0, 0, 1, 20, 0, 10, 1, 0, 1, 21, 0;  // weights that do not sum to one are made to
  EXPECT_EQ(mesh.V, expected);
}

TEST(Gltf, EveryMistakeIsNamed) {
  const Scratch scratch;
  const auto refused = [&](const std::string& part, const auto& change, Parts parts = {}) {
    change(parts.gltf);
    expect_error(ErrorKind::data, part, [&] { read_glb(scratch, parts); });
  };
  refused("requires KHR_draco_mesh_compression (save it without that extension)",
          [](json& g) { g["extensionsRequired"] = {"KHR_draco_mesh_compression"}; });
  refused("an accessor has no buffer view: its geometry is compressed",
          [](json& g) { g["accessors"][0].erase("bufferView"); });
  refused("lies outside its buffer", [](json& g) { g["accessors"][0]["count"] = 1000000000; });
  refused("lies outside its buffer", [](json& g) { g["bufferViews"][0]["byteLength"] = 100000; });
  refused("an index is 3, of 3 points", [](json& g) { g["accessors"][0]["count"] = 3; });
  refused("its nodes are no tree", [](json& g) { g["nodes"] = {{{"children", {1}}}, {{"children", {0}}}}; });
  refused("names node 7 of 1", [](json& g) { g["scenes"][0]["nodes"] = {7}; });
  refused("a node names mesh 7 of 2", [](json& g) { g["nodes"][0]["mesh"] = 7; });
  refused("names scene 3 of 1", [](json& g) { g["scene"] = 3; });
  refused("a buffer view names buffer 4 of 1", [](json& g) { g["bufferViews"][0]["buffer"] = 4; });
  refused("a primitive is of mode 9", [](json& g) { g["meshes"][0]["primitives"][0]["mode"] = 9; });
  refused(
      "a node names a skin that is not there", [](json& g) { g["nodes"][0]["skin"] = 5; }, skinned());
  refused(
      "a joint of its skin is not in the scene",
      [](json& g) {
        g["scenes"][0]["nodes"] = {0, 1};
      },
      skinned());
  refused(
      "its weights are not as many as its points", [](json& g) { g["accessors"][6]["count"] = 4; },
      skinned());
  refused("a node's matrix is not affine",
          [](json& g) { g["nodes"][0]["matrix"] = {1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; });
  refused("a node's rotation is no quaternion", [](json& g) { g["nodes"][0]["rotation"] = {0, 0, 0, 0}; });
  refused(
      "a weight names a joint that is not there", [](json& g) { g["skins"][0]["joints"] = {1}; }, skinned());
  refused("an accessor names buffer view 40 of 5", [](json& g) { g["accessors"][0]["bufferView"] = 40; });
  refused("a mesh names accessor 30 of 5",
          [](json& g) { g["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 30; });
  refused("an accessor has not 3 values a row", [](json& g) { g["accessors"][0]["type"] = "VEC2"; });
  Parts bound = skinned();
  bound.add<float>({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, 5126, "MAT4", 1);
  refused(
      "a skin has fewer matrices than joints", [](json& g) { g["skins"][0]["inverseBindMatrices"] = 7; },
      bound);
  refused("a node's transform is damaged", [](json& g) { g["nodes"][0]["scale"] = {1, 2}; });
  refused("an accessor is of component type 5124",
          [](json& g) { g["accessors"][0]["componentType"] = 5124; });
  refused("its indices are no whole numbers", [](json& g) {
    g["accessors"][1]["componentType"] = 5126;
    g["accessors"][1]["count"] = 3;
  });
  const auto sparse = [](json& accessor, int type, int count) {
    accessor["sparse"] = {{"count", count},
                          {"indices", {{"bufferView", 1}, {"componentType", type}}},
                          {"values", {{"bufferView", 0}}}};
  };
  refused("a sparse accessor is damaged", [&](json& g) { sparse(g["accessors"][0], 5126, 1); });
  refused("a sparse accessor is damaged (save", [&](json& g) {  // its third index is 2
    sparse(g["accessors"][0], 5123, 3);
    g["accessors"][0]["count"] = 2;
  });
  refused("takes more memory than its", [&](json& g) {
    sparse(g["accessors"][0], 5123, 1);
    g["accessors"][0].erase("bufferView");
    g["accessors"][0]["count"] = 100000000;
  });
  refused("has no triangle", [](json& g) {
    g["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"mode", 1}}}}}};
  });
  refused("nested more than 64 deep", [](json& g) {
    json deep = 1;
    for (int i = 0; i < 100; ++i) deep = json::array({deep});
    g["extras"] = deep;
  });
  Parts parts;
  const std::string whole = parts.glb();
  expect_error(ErrorKind::data, "is no GLB", [&] { read_surface(scratch.put("b.glb", "solid x")); });
  expect_error(ErrorKind::data, "is no GLB",
               [&] { read_surface(scratch.put("b.glb", std::string(40, 'x'))); });
  std::string odd;
  append<std::uint32_t>(odd, {0x46546C67, 2, 25, 5, 0x4E4F534A});
  expect_error(ErrorKind::data, "its JSON chunk is not padded to 4 bytes",
               [&] { read_surface(scratch.put("b.glb", odd + "{   }")); });
  std::string old;
  append<std::uint32_t>(old, {0x46546C67, 1, 25, 5, 0x4E4F534A});
  expect_error(ErrorKind::data, "is of glTF version 1 (save it as glTF 2.0)",
               [&] { read_surface(scratch.put("b.glb", old + "{   }")); });
  std::string damaged;
  append<std::uint32_t>(damaged, {0x46546C67, 2, 25, 500, 0x4E4F534A});
  expect_error(ErrorKind::data, "its JSON chunk is damaged",
               [&] { read_surface(scratch.put("b.glb", damaged + "{   }")); });
  expect_error(ErrorKind::data, "bytes, but has", [&] { read_surface(scratch.put("b.glb", whole + "x")); });
  expect_error(ErrorKind::data, "is no glTF: it is no JSON object",
               [&] { read_surface(scratch.put("b.gltf", whole)); });
}

}  // namespace
}  // namespace ecorche::io
