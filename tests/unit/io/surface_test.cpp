// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "io/surface/stl.hpp"
#include "io/surface/surface_file.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/small_case.hpp"
#include "tests/unit/io/vtk_reading.hpp"

namespace ecorche::io {
namespace {

const SurfaceMesh& block() {
  static const SurfaceMesh mesh = box({-1.5, 2, 3.25}, {4, 5.125, 60});
  return mesh;
}

std::string text_stl(const SurfaceMesh& mesh) {
  std::string out = "solid  a box\n";
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    out += " FACET normal 0 0 1e-400\n  outer loop\n";
    for (int c = 0; c < 3; ++c) {
      out += "   vertex";
      for (int k = 0; k < 3; ++k) out += " " + std::to_string(mesh.V(mesh.F(f, c), k));
      out += "\r\n";
    }
    out += "  endloop\n endfacet\n";
  }
  return out + "endsolid a box\n";
}

void expect_same(const SurfaceMesh& a, const SurfaceMesh& b) {
  ASSERT_EQ(a.V.rows(), b.V.rows());
  EXPECT_EQ(a.V, b.V);
  EXPECT_EQ(a.F, b.F);
}

TEST(Stl, BinaryComesBackAndVtkAgrees) {
  const Scratch scratch;
  write_surface(scratch / "a.stl", block());
  expect_same(read_surface(scratch / "a.stl"), block());
  expect_same(foreign::vtk_surface(scratch / "a.stl"), block());
  EXPECT_EQ(read_tagged_surface(scratch / "a.stl").space, "LPS");
}

TEST(Stl, TextIsReadAsVtkReadsIt) {
  const Scratch scratch;
  const auto path = scratch.put("a.stl", text_stl(block()));
  expect_same(read_surface(path), block());
  expect_same(foreign::vtk_surface(path), block());
}

TEST(Stl, BinaryThatBeginsWithSolidIsBinary) {
  std::string bytes = stl::encode(block());
  std::memcpy(bytes.data(), "solid SPACE=RAS", 15);
  expect_same(stl::decode(bytes, "a"), block());
  EXPECT_EQ(stl::space_tag(bytes), "RAS");
}

TEST(Stl, EqualCornersMergeInOrderOfFirstUse) {
  SurfaceMesh soup;
  soup.V.resize(6, 3);
  soup.V << 5, 0, 0, 0, 0, 0, 0, 7, 0, 0, 7, 0, -0.0, 0, -0.0, 0, 0, 9;
  soup.F.resize(3, 3);
  soup.F << 0, 1, 2, 3, 4, 5, 5, 5, 1;  // the last has two equal corners, and is kept
  const SurfaceMesh mesh = stl::decode(stl::encode(soup), "a");
  ASSERT_EQ(mesh.V.rows(), 4);
  Triangles expected(3, 3);
  expected << 0, 1, 2, 2, 1, 3, 3, 3, 1;
  EXPECT_EQ(mesh.F, expected);
}

TEST(Stl, MergingEqualsAnExhaustiveSearch) {
  std::mt19937 random(3);
  SurfaceMesh soup;
  soup.V.resize(600, 3);
  soup.F.resize(200, 3);
  for (Eigen::Index i = 0; i < soup.V.size(); ++i) soup.V.data()[i] = static_cast<double>(random() % 5) - 2;
  for (int i = 0; i < 600; ++i) soup.F.data()[i] = i;
  const SurfaceMesh mesh = stl::decode(stl::encode(soup), "a");
  std::vector<Eigen::RowVector3d> seen;
  for (Eigen::Index i = 0; i < 600; ++i) {
    const Eigen::RowVector3d p = soup.V.row(i);
    std::size_t at = 0;
    while (at < seen.size() && seen[at] != p) ++at;
    if (at == seen.size()) seen.push_back(p);
    ASSERT_EQ(mesh.F.data()[i], static_cast<std::int32_t>(at));
    ASSERT_EQ(mesh.V.row(mesh.F.data()[i]), p);
  }
  EXPECT_EQ(mesh.V.rows(), static_cast<Eigen::Index>(seen.size()));
}

TEST(Stl, EveryPrefixIsRefused) {
  const std::string binary = stl::encode(block());
  for (std::size_t n = 0; n < binary.size(); ++n)
    EXPECT_THROW(stl::decode(binary.substr(0, n), "a"), Error) << n;
  const std::string text = text_stl(block());
  // Without its last words "a box" and line ends the file still says all.
  const std::size_t whole = text.rfind("endsolid") + std::strlen("endsolid");
  for (std::size_t n = 0; n < whole; ++n) EXPECT_THROW(stl::decode(text.substr(0, n), "a"), Error) << n;
  EXPECT_NO_THROW(stl::decode(text.substr(0, whole), "a"));
}

// Whatever bytes are flipped: a mesh whose triangles lie in it, or an Error.
TEST(Stl, FlippedBytesNeverHarm) {
  std::mt19937 random(11);
  for (const std::string& whole : {stl::encode(block()), text_stl(block())}) {
    int read = 0;
    for (int round = 0; round < 3000; ++round) {
      std::string bytes = whole;
      for (int flips = 0; flips < 1 + round % 3; ++flips)
        bytes[random() % bytes.size()] = static_cast<char>(random());
      try {
        const SurfaceMesh mesh = stl::decode(bytes, "a");
        ASSERT_GE(mesh.F.minCoeff(), 0);
        ASSERT_LT(mesh.F.maxCoeff(), mesh.V.rows());
        ASSERT_TRUE(mesh.V.allFinite());
        ++read;
      } catch (const Error& error) {
        ASSERT_EQ(static_cast<int>(error.kind()), static_cast<int>(ErrorKind::data));
      }
    }
    EXPECT_GT(read, 20);  // those that hit a normal or a digit: the decoder is met
  }
}

TEST(Stl, EveryMistakeIsNamed) {
  const auto refused = [](const std::string& bytes, const std::string& part) {
    expect_error(ErrorKind::data, part, [&] { stl::decode(bytes, "leg.stl"); });
  };
  const std::string whole = stl::encode(block());
  std::string bytes = whole;
  bytes[80] = bytes[81] = bytes[82] = bytes[83] = '\xff';
  refused(bytes, "leg.stl: says 4294967295 triangles, which take 214748364834 bytes, but has 684");
  refused(whole + "x", "leg.stl: says 12 triangles, which take 684 bytes, but has 685");
  refused("", "leg.stl: is no STL: 0 bytes");
  refused(std::string(84, '\0'), "leg.stl: has no triangle");
  refused("solid a\nendsolid a\n", "leg.stl: has no triangle");
  bytes = whole;
  const float nan = NAN, huge = 2e9F;
  std::memcpy(bytes.data() + 84 + 50 + 12, &nan, 4);
  refused(bytes,
          "leg.stl: triangle 1 has the coordinate nan (every coordinate must be finite and below 1e9)");
  std::memcpy(bytes.data() + 84 + 50 + 12, &huge, 4);
  refused(bytes, "leg.stl: triangle 1 has the coordinate 2e+09");
  refused("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 x\n", "leg.stl:4: expected a number, found 'x'");
  refused("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 1e400\n", "triangle 0 has the coordinate inf");
  refused("solid\nfacet normal 0 0 1\nouter\n", "leg.stl:4: expected 'loop', the file ends");
  refused("solid\nendsolid\nfoo", "leg.stl:3: expected 'solid' or the end of the file, found 'foo'");
}

TEST(Surface, OtherFilesAreRefused) {
  const Scratch scratch;
  expect_error(ErrorKind::data, "a.fbx: '.fbx' surfaces cannot be read (convert it to .stl, .obj,",
               [&] { read_surface(scratch.put("a.fbx", "v 0 0 0")); });
  expect_error(ErrorKind::missing_input, "none.stl", [&] { read_surface(scratch / "none.stl"); });
  expect_error(ErrorKind::missing_input, "is a folder", [&] {
    std::filesystem::create_directory(scratch / "folder.stl");
    read_surface(scratch / "folder.stl");
  });
  expect_error(ErrorKind::usage, "cannot write '.fbx' surfaces (use .stl, .obj, .ply, .off, .vtp or .glb)",
               [&] { write_surface(scratch / "a.fbx", block()); });
  expect_error(ErrorKind::usage, "a.stl: '.stl' does not hold several surfaces (use .glb)",
               [&] { write_surfaces(scratch / "a.stl", {}); });
  expect_error(ErrorKind::cannot_create, "a.ply",
               [&] { write_surface(scratch / "none" / "a.ply", block()); });
  expect_error(
      ErrorKind::usage,
      "cannot write tets as '.vtk' (use .vtu, .msh, .ele, .inp or .mcnp.inp; a rig goes into .glb or .bvh)",
      [&] { write_tets(scratch / "a.vtk", {}, {}, {}, {}); });
}

TEST(Surface, NothingIsLeftWhereWritingFails) {
  const Scratch scratch;
  SurfaceMesh wrong = block();
  wrong.F(3, 1) = 8;
  for (const char* name : {"a.stl", "a.obj", "a.ply", "a.off", "a.vtp", "a.glb"}) {
    expect_error(ErrorKind::internal, "uses vertex 8", [&] { write_surface(scratch / name, wrong); });
  }
  EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

TEST(Surface, VtkReadsPlyAndVtp) {
  const Scratch scratch;
  for (const char* name : {"a.ply", "a.vtp"}) {
    write_surface(scratch / name, block());
    expect_same(foreign::vtk_surface(scratch / name), block());
  }
  EXPECT_NE(scratch.get("a.ply").find("comment SPACE=LPS"), std::string::npos);
}

TEST(Surface, GlbIsMetresLeftUpForward) {
  const Scratch scratch;
  write_surface(scratch / "a.glb", block());
  const foreign::Glb glb = foreign::gltf_surface(scratch / "a.glb");
  EXPECT_EQ(glb.F, block().F);
  ASSERT_EQ(glb.positions.rows(), 8);
  for (Eigen::Index i = 0; i < 8; ++i) {
    // left, superior, anterior of LPS (x, y, z)
    const Eigen::RowVector3d lps = block().V.row(i) / 1000;
    EXPECT_TRUE(
        glb.positions.row(i).cast<double>().isApprox(Eigen::RowVector3d(lps.x(), lps.z(), -lps.y()), 1e-6));
    // A corner of a box looks away from its middle.
    const Eigen::RowVector3f middle =
        0.5F * (glb.positions.colwise().minCoeff() + glb.positions.colwise().maxCoeff());
    EXPECT_GT((glb.positions.row(i) - middle).cwiseProduct(glb.normals.row(i)).minCoeff(), 0);
    EXPECT_NEAR(glb.normals.row(i).norm(), 1, 1e-6);
  }
  EXPECT_NEAR(glb.lowest.at(2), -5.125e-3, 1e-9);
  EXPECT_NEAR(glb.highest.at(1), 60e-3, 1e-8);
}

TEST(Tets, VtkReadsThemWithTheirArrays) {
  const Scratch scratch;
  PointsF V(5, 3);
  V << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1;
  Tets T(2, 4);
  T << 0, 1, 2, 3, 1, 2, 3, 4;
  const std::vector<float> weights{0, 0.25F, 0.5F, 0.75F, 1}, pairs{1, 2, 3, 4};
  write_tets(scratch / "a.vtu", V, T, {{"weight", 1, weights}}, {{"pair", 2, pairs}});
  const foreign::Grid grid = foreign::vtk_tets(scratch / "a.vtu");
  EXPECT_EQ(grid.V, V);
  EXPECT_EQ(grid.T, T);
  EXPECT_EQ(grid.point_data.at("weight"), weights);
  EXPECT_EQ(grid.cell_data.at("pair"), pairs);
  expect_error(ErrorKind::internal, "weight: has 4 values for 5 rows of 1 (report this)", [&] {
    write_tets(scratch / "b.vtu", V, T, {{"weight", 1, pairs}}, {});
  });
}

}  // namespace
}  // namespace ecorche::io
