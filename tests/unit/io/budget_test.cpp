// SPDX-License-Identifier: Apache-2.0
// Small files that ask for much: refused before the memory is taken, as the kernel counted it.
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "io/motion/gltf_clip.hpp"
#include "io/surface/gltf.hpp"
#include "io/surface/obj.hpp"
#include "io/surface/off.hpp"
#include "io/surface/ply.hpp"
#include "io/surface/stl.hpp"
#include "io/surface/vtk_legacy.hpp"
#include "io/surface/vtp.hpp"
#include "io/surface/vtu.hpp"
#include "tests/support/peak_memory.hpp"
#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

using files::ReadLimits;
using nlohmann::json;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

template <class T>
std::string packed(const std::vector<T>& values) {
  std::string out(values.size() * sizeof(T), '\0');
  std::memcpy(out.data(), values.data(), out.size());
  return out;
}

std::string glb(const json& gltf, const std::string& binary) {
  std::string text = gltf.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const auto word = [](std::size_t x) { return packed<std::uint32_t>({static_cast<std::uint32_t>(x)}); };
  const std::string chunk = binary.empty() ? "" : word(binary.size()) + std::string("BIN\0", 4) + binary;
  return "glTF" + word(2) + word(20 + text.size() + chunk.size()) + word(text.size()) + "JSON" + text + chunk;
}

// Points that no byte stands for, and one that does.
std::string sparse_glb(std::uint64_t rows) {
  const std::string binary = packed<std::uint32_t>({0}) + packed<float>({1, 2, 3});
  return glb({{"asset", {{"version", "2.0"}}},
              {"buffers", {{{"byteLength", binary.size()}}}},
              {"bufferViews",
               {{{"buffer", 0}, {"byteLength", 4}}, {{"buffer", 0}, {"byteOffset", 4}, {"byteLength", 12}}}},
              {"accessors",
               {{{"componentType", 5126},
                 {"type", "VEC3"},
                 {"count", rows},
                 {"sparse",
                  {{"count", 1},
                   {"indices", {{"bufferView", 0}, {"componentType", 5125}}},
                   {"values", {{"bufferView", 1}}}}}}}},
              {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}}}}}}},
              {"nodes", {{{"mesh", 0}}}},
              {"scenes", {{{"nodes", {0}}}}},
              {"scene", 0}},
             binary);
}

// `nodes` nodes that all show one strip of `triangles`.
std::string instances_glb(std::size_t nodes, std::size_t triangles) {
  std::vector<float> points;
  std::vector<std::uint16_t> corners;
  for (std::size_t i = 0; i < triangles + 2; ++i) {
    points.insert(points.end(), {static_cast<float>(i), static_cast<float>(i % 2), 0});
    corners.push_back(static_cast<std::uint16_t>(i));
  }
  corners.resize((corners.size() + 1) / 2 * 2);
  const std::string places = packed(points), binary = places + packed(corners);
  json all = json::array(), roots = json::array();
  for (std::size_t n = 0; n < nodes; ++n) {
    all.push_back({{"mesh", 0}});
    roots.push_back(n);
  }
  return glb(
      {{"asset", {{"version", "2.0"}}},
       {"buffers", {{{"byteLength", binary.size()}}}},
       {"bufferViews",
        {{{"buffer", 0}, {"byteLength", places.size()}},
         {{"buffer", 0}, {"byteOffset", places.size()}, {"byteLength", binary.size() - places.size()}}}},
       {"accessors",
        {{{"bufferView", 0}, {"componentType", 5126}, {"type", "VEC3"}, {"count", points.size() / 3}},
         {{"bufferView", 1}, {"componentType", 5123}, {"type", "SCALAR"}, {"count", triangles + 2}}}},
       {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}, {"mode", 5}}}}}}},
       {"nodes", all},
       {"scenes", {{{"nodes", roots}}}},
       {"scene", 0}},
      binary);
}

// `pieces` pieces whose points and triangles are the same bytes.
std::string shared_vtp(std::size_t pieces, std::size_t points) {
  std::vector<float> places;
  std::vector<std::int32_t> corners, ends;
  for (std::size_t i = 0; i < points; ++i) {
    places.insert(places.end(), {static_cast<float>(i), static_cast<float>(i % 2), 0});
    if (i + 2 >= points) continue;
    for (std::size_t k = 0; k < 3; ++k) corners.push_back(static_cast<std::int32_t>(i + k));
    ends.push_back(static_cast<std::int32_t>(corners.size()));
  }
  std::string data;
  const auto add = [&](const std::string& bytes) {
    const std::string offset = std::to_string(data.size());
    data += packed<std::uint32_t>({static_cast<std::uint32_t>(bytes.size())}) + bytes;
    return "\" format=\"appended\" offset=\"" + offset + "\"/>";
  };
  const std::string array = "<DataArray type=\"";
  const std::string piece = "<Piece NumberOfPoints=\"" + std::to_string(points) + "\" NumberOfPolys=\"" +
                            std::to_string(ends.size()) + "\"><Points>" + array +
                            "Float32\" NumberOfComponents=\"3" + add(packed(places)) + "</Points><Polys>" +
                            array + "Int32\" Name=\"connectivity" + add(packed(corners)) + array +
                            "Int32\" Name=\"offsets" + add(packed(ends)) + "</Polys></Piece>";
  std::string file = "<VTKFile type=\"PolyData\"><PolyData>";
  for (std::size_t p = 0; p < pieces; ++p) file += piece;
  return file + "</PolyData><AppendedData encoding=\"raw\">_" + data + "</AppendedData></VTKFile>";
}

void expect_refused(const test::Peak& peak, std::uint64_t most, const std::string& size) {
  EXPECT_NE(peak.error.find("takes more memory than its " + size + " bytes stand for: over "),
            std::string::npos)
      << peak.error;
  EXPECT_NE(peak.error.find("(if it is what you mean to read, allow more by --read-budget MIB)"),
            std::string::npos);
  EXPECT_LT(peak.grown / kMiB, most / kMiB);
}

TEST(Budget, APointForNoByte) {
  const std::string file = sparse_glb(std::uint64_t{1} << 26);
  ASSERT_LT(file.size(), 600U);
  expect_refused(test::peak_of([&] { gltf::decode(file, "a.glb"); }), 64 * kMiB, std::to_string(file.size()));
  // Rows whose bytes nobody can count.
  const std::string endless = sparse_glb(std::uint64_t{1} << 63);
  expect_refused(test::peak_of([&] { gltf::decode(endless, "a.glb"); }), 64 * kMiB,
                 std::to_string(endless.size()));
  EXPECT_EQ(gltf::decode(sparse_glb(3), "a.glb").F.rows(), 1);
}

TEST(Budget, NodesThatShareAMesh) {
  const std::string file = instances_glb(3000, 12000);
  ASSERT_LT(file.size(), 373000U);
  expect_refused(test::peak_of([&] { gltf::decode(file, "a.glb"); }), 512 * kMiB,
                 std::to_string(file.size()));
  // A few are what instances are for; more are read where they are asked for.
  const std::string few = instances_glb(20, 12000);
  EXPECT_EQ(gltf::decode(few, "a.glb").F.rows(), 240000);
  const ReadLimits none{.base = 0, .image_base = 0, .per_byte = 16};
  expect_error(ErrorKind::data, "a.glb: takes more memory than its " + std::to_string(few.size()) + " bytes",
               [&] { gltf::decode(few, "a.glb", none); });
  EXPECT_EQ(gltf::decode(few, "a.glb", ReadLimits::of(128 * kMiB)).F.rows(), 240000);
}

TEST(Budget, PiecesThatShareAnArray) {
  const std::string file = shared_vtp(1000, 15000);
  ASSERT_LT(file.size(), 910000U);
  expect_refused(test::peak_of([&] { vtp::decode(file, "a.vtp"); }), 512 * kMiB, std::to_string(file.size()));
  EXPECT_EQ(vtp::decode(shared_vtp(3, 15000), "a.vtp").mesh.F.rows(), 3 * 14998);
}

// Empty objects cost tinygltf a kilobyte each.
TEST(Budget, ObjectsThatSayNothing) {
  json nodes = json::array();
  for (int n = 0; n < 400000; ++n) nodes.push_back(json::object());
  const std::string file = json{{"asset", {{"version", "2.0"}}}, {"nodes", nodes}}.dump();
  expect_refused(test::peak_of([&] { gltf::decode(file, "a.gltf"); }), 64 * kMiB,
                 std::to_string(file.size()));
}

TEST(Budget, ElementsInElements) {
  std::string file;
  for (int n = 0; n < 300000; ++n) file += "<a>";
  const test::Peak peak = test::peak_of([&] { vtp::decode(file, "a.vtp"); });
  EXPECT_EQ(peak.error, "a.vtp: its elements are nested more than 64 deep (save the surface again)");
  EXPECT_LT(peak.grown, 16 * kMiB);
}

// Tracks of one clip that share their values.
TEST(Budget, AClipIsHeldToItToo) {
  json channels = json::array(), nodes = json::array(), roots = json::array();
  for (int n = 0; n < 2000; ++n) {
    nodes.push_back(json::object());
    roots.push_back(n);
    channels.push_back({{"sampler", 0}, {"target", {{"node", n}, {"path", "rotation"}}}});
  }
  std::vector<float> values;
  for (int k = 0; k < 20000; ++k) values.push_back(static_cast<float>(k));
  const std::size_t times = 4 * values.size();
  for (int k = 0; k < 20000; ++k) values.insert(values.end(), {0, 0, 0, 1});
  const std::string binary = packed(values);
  const std::string file =
      glb({{"asset", {{"version", "2.0"}}},
           {"buffers", {{{"byteLength", binary.size()}}}},
           {"bufferViews",
            {{{"buffer", 0}, {"byteLength", times}},
             {{"buffer", 0}, {"byteOffset", times}, {"byteLength", binary.size() - times}}}},
           {"accessors",
            {{{"bufferView", 0}, {"componentType", 5126}, {"type", "SCALAR"}, {"count", 20000}},
             {{"bufferView", 1}, {"componentType", 5126}, {"type", "VEC4"}, {"count", 20000}}}},
           {"animations", {{{"channels", channels}, {"samplers", {{{"input", 0}, {"output", 1}}}}}}},
           {"nodes", nodes},
           {"scenes", {{{"nodes", roots}}}},
           {"scene", 0}},
          binary);
  expect_refused(test::peak_of([&] { parse_gltf_clip(file, "a.glb"); }), 512 * kMiB,
                 std::to_string(file.size()));
}

// Formats that list what they hold: never refused at the bytes that are theirs, and always beyond them.
TEST(Budget, EveryDecoderAsks) {
  const ReadLimits none{.base = 0, .image_base = 0, .per_byte = 1};
  const auto refused = [](const auto& decode) { expect_error(ErrorKind::data, "bytes stand for", decode); };
  const std::string stl = [] {
    std::string out(80, ' ');
    out += packed<std::uint32_t>({1}) + packed<float>({0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0}) +
           std::string(2, '\0');
    return out;
  }();
  EXPECT_EQ(stl::decode(stl, "a").F.rows(), 1);
  refused([&] { stl::decode(stl, "a", none); });
  const std::string text =
      "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
      "endsolid\n";
  EXPECT_EQ(stl::decode(text, "a").F.rows(), 1);
  refused([&] { stl::decode(text, "a", none); });
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  EXPECT_EQ(obj::decode(obj, "a").F.rows(), 1);
  refused([&] { obj::decode(obj, "a", none); });
  const std::string off = "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  EXPECT_EQ(off::decode(off, "a").F.rows(), 1);
  refused([&] { off::decode(off, "a", none); });
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  EXPECT_EQ(ply::decode(ply, "a").F.rows(), 1);
  refused([&] { ply::decode(ply, "a", none); });
  const std::string vtk =
      "# vtk DataFile Version 4.2\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n"
      "POLYGONS 1 4\n3 0 1 2\n";
  EXPECT_EQ(vtk_legacy::decode(vtk, "a").F.rows(), 1);
  refused([&] { vtk_legacy::decode(vtk, "a", none); });
  refused([&] { vtp::decode(shared_vtp(1, 3), "a", ReadLimits{.base = 0, .image_base = 0, .per_byte = 0}); });
  const std::string array = "<DataArray type=\"Int32\" format=\"ascii\" ";
  const std::string vtu =
      "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">"
      "<Points>" +
      array + "NumberOfComponents=\"3\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells>" + array +
      "Name=\"connectivity\">0 1 2 3</DataArray>" + array + "Name=\"offsets\">4</DataArray>" + array +
      "Name=\"types\">10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>";
  EXPECT_EQ(vtu::decode(vtu, "a").T.rows(), 1);
  refused([&] { vtu::decode(vtu, "a", none); });
}

}  // namespace
}  // namespace ecorche::io
