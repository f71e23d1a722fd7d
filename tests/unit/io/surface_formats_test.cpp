// SPDX-License-Identifier: Apache-2.0
// Every format of surfaces against foreign writers and readers.
#include <gtest/gtest.h>

#include <cmath>

#include "io/surface/surface_file.hpp"
#include "io/surface/vtk_files.hpp"
#include "tests/unit/io/foreign_surfaces.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/small_case.hpp"
#include "tests/unit/io/soups.hpp"
#include "tests/unit/io/vtk_reading.hpp"

namespace ecorche::io {
namespace {

// A bumpy sphere: no two triangles alike.
SurfaceMesh ball() {
  constexpr int rings = 9, sides = 14;
  SurfaceMesh mesh;
  mesh.V.resize(2 + (rings - 1) * sides, 3);
  mesh.F.resize(2 * sides * (rings - 1), 3);
  const auto at = [](int ring, int side) { return 2 + (ring - 1) * sides + side % sides; };
  Eigen::Index f = 0;
  mesh.V.row(0) << 0, 0, 10.25;
  mesh.V.row(1) << 0, 0, -10.5;
  for (int r = 1; r < rings; ++r) {
    for (int s = 0; s < sides; ++s) {
      const double a = M_PI * r / rings, b = 2 * M_PI * s / sides, radius = 10 + std::sin(3 * a + 2 * b);
      mesh.V.row(at(r, s)) =
          (radius * Eigen::RowVector3d(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)));
      if (r == 1) mesh.F.row(f++) << 0, at(1, s), at(1, s + 1);
      if (r == rings - 1) mesh.F.row(f++) << 1, at(r, s + 1), at(r, s);
      if (r == rings - 1) continue;
      mesh.F.row(f++) << at(r, s), at(r + 1, s), at(r + 1, s + 1);
      mesh.F.row(f++) << at(r, s), at(r + 1, s + 1), at(r, s + 1);
    }
  }
  const PointsF narrow = mesh.V.cast<float>();
  mesh.V = narrow.cast<double>();
  return mesh;
}

void expect_same(const SurfaceMesh& a, const SurfaceMesh& b) {
  ASSERT_EQ(a.V.rows(), b.V.rows());
  EXPECT_EQ((a.V - b.V).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(a.F, b.F);
}

TEST(SurfaceFormats, WhatVtkWritesIsReadVertexForVertex) {
  const Scratch scratch;
  const SurfaceMesh mesh = ball();
  const std::vector<std::pair<std::string, std::vector<std::string>>> forms{
      {"a.ply", {"text", "little", "big"}},
      {"a.vtk", {"text", "binary", "text4", "binary4"}},
      {"a.vtp", {"text", "inline", "raw", "base64", "big", "zlib", "zlib64"}},
      {"a.obj", {""}}};
  for (const auto& [name, ways] : forms) {
    for (const std::string& way : ways) {
      SCOPED_TRACE(name + " " + way);
      foreign::vtk_write(scratch / name, mesh, way);
      const SurfaceMesh read = read_surface(scratch / name);
      if (way.starts_with("text") || name == "a.obj") {  // six digits
        ASSERT_EQ(read.V.rows(), mesh.V.rows());
        EXPECT_LT((read.V - mesh.V).cwiseAbs().maxCoeff(), 1e-4);
        EXPECT_EQ(read.F, mesh.F);
      } else {
        expect_same(read, mesh);
      }
    }
  }
}

TEST(SurfaceFormats, VtksStripsAreTheSameTriangles) {
  const Scratch scratch;
  for (const auto& [name, way] :
       {std::pair("a.vtk", "binary"), {"a.vtk", "binary4"}, {"a.vtp", "raw"}, {"a.vtp", "zlib"}}) {
    foreign::vtk_write(scratch / name, ball(), std::string("strips ") + way);
    EXPECT_EQ(soup(read_surface(scratch / name)), soup(ball())) << name << " " << way;
  }
}

TEST(SurfaceFormats, AssimpWritesWhatIsRead) {
  const Scratch scratch;
  for (const auto& [name, format] : {std::pair("a.glb", "glb2"), {"a.gltf", "gltf2"}, {"a.ply", "plyb"}}) {
    foreign::assimp_write(scratch / name, ball(), format);
    EXPECT_EQ(soup(read_surface(scratch / name)), soup(ball())) << name;
  }
  for (const auto& [name, format] : {std::pair("a.obj", "obj"), {"b.ply", "ply"}}) {  // six digits
    foreign::assimp_write(scratch / name, ball(), format);
    const SurfaceMesh read = read_surface(scratch / name);
    ASSERT_EQ(read.V.rows(), ball().V.rows()) << name;
    EXPECT_EQ(read.F.rows(), ball().F.rows()) << name;
  }
}

TEST(SurfaceFormats, WhatIsWrittenComesBackAndOthersAgree) {
  const Scratch scratch;
  const SurfaceMesh mesh = ball();
  for (const char* name : {"a.stl", "a.obj", "a.ply", "a.off", "a.vtp"}) {
    write_surface(scratch / name, mesh);
    EXPECT_EQ(soup(read_surface(scratch / name)), soup(mesh)) << name;
    if (std::string(name) != "a.vtp") {
      EXPECT_LT(soup_distance(foreign::assimp_surface(scratch / name), mesh), 1e-5) << name;
      EXPECT_EQ(read_tagged_surface(scratch / name).space, "LPS") << name;
    }
  }
  expect_same(foreign::vtk_surface(scratch / "a.obj"), mesh);
  write_surface(scratch / "a.glb", mesh);
  const TaggedSurface glb = read_tagged_surface(scratch / "a.glb");
  EXPECT_EQ(glb.space, "LSA");
  EXPECT_EQ(glb.unit_mm, 1000);
  ASSERT_EQ(glb.mesh.V.rows(), mesh.V.rows());
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i) {  // left, superior, anterior
    const Eigen::RowVector3d p = 1000 * glb.mesh.V.row(i);
    EXPECT_TRUE(Eigen::RowVector3d(p.x(), -p.z(), p.y()).isApprox(mesh.V.row(i), 1e-6));
  }
}

// Polygons are cut as assimp cuts them, or at least into the same area, facing the same way.
TEST(SurfaceFormats, HollowPolygonsKeepTheirArea) {
  const Scratch scratch;
  // An L of area 3 with its first corner such that a fan from it leaves the L, and beside it a pentagon.
  const std::string obj =
      "# made by hand SPACE=RAS\nmtllib x.mtl\no first\nv 2 0 0\nv 2 1 0 0.5 0.5 0.5\nv 1 1 0\nv 1 2 0\nv 0 "
      "2 0\nv 0 0 0\n"
      "vt 0 0\nvn 0 0 1\ng group\nusemtl m\ns off\nf -6/1/1 -5/1/1 -4/1/1 -3//1 \\\n-2/1 -1\nl 1 2\n"
      "o second\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0.5 2 1\nv 0 1 1\nf 7 8 9 10 11\n";
  const TaggedSurface read = read_tagged_surface(scratch.put("a.obj", obj));
  EXPECT_EQ(read.space, "RAS");
  EXPECT_EQ(read.mesh.F.rows(), 4 + 3);
  double area = 0;
  for (Eigen::Index f = 0; f < read.mesh.F.rows(); ++f) {
    const Eigen::RowVector3d a = read.mesh.V.row(read.mesh.F(f, 0)), b = read.mesh.V.row(read.mesh.F(f, 1)),
                             c = read.mesh.V.row(read.mesh.F(f, 2));
    const double z = (b - a).cross(c - a).z() / 2;
    EXPECT_GT(z, 0);
    area += z;
  }
  EXPECT_NEAR(area, 3 + 1.5, 1e-12);
}

TEST(SurfaceFormats, OffWithColoursAndCommentsIsRead) {
  const Scratch scratch;
  const std::string off =
      "COFF # colours\n\n# SPACE=RAS\n4 2 0\n0 0 0 255 0 0 255\n1 0 0 0 0 0 0 # red\n1 1 0 1 1 1 1\n0 1 0 1 "
      "1 1 1\n"
      "3 0 1 2 0.5 0.5 0.5\n4 0 1 2 3\n";
  const TaggedSurface read = read_tagged_surface(scratch.put("a.off", off));
  EXPECT_EQ(read.mesh.F.rows(), 3);
  EXPECT_EQ(read.mesh.V.rows(), 4);
  EXPECT_EQ(read_surface(scratch.put("b.off", "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")).F.rows(), 1);
}

// Its words may stand on any line; behind the last corner of a face its line belongs to it.
TEST(SurfaceFormats, OffWhoseFacesWrapOverLinesIsRead) {
  const Scratch scratch;
  const std::string plain = "OFF\n5 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n5 0 1 2 3 4\n3 0 1 4\n";
  const std::string wrapped =
      "OFF\n5\n2 0\n0 0 0\n1 0\n0\n1 1 0\n0 1 0\n0 0 1\n5 0 1 # half\n\n  2 3\n4 255 0 0\n3\n0\n1\n4\n";
  const SurfaceMesh one = read_surface(scratch.put("a.off", plain));
  const SurfaceMesh other = read_surface(scratch.put("b.off", wrapped));
  EXPECT_EQ(one.F.rows(), 4);
  EXPECT_EQ(other.V, one.V);
  EXPECT_EQ(other.F, one.F);
}

TEST(SurfaceFormats, PlyStripsAndForeignElementsAreRead) {
  const Scratch scratch;
  const std::string ply =
      "ply\r\nformat ascii 1.0\r\ncomment SPACE=RAS\r\nobj_info by hand\r\nelement camera 1\r\nproperty "
      "float f\r\n"
      "property list uchar int ids\r\nelement vertex 5\r\nproperty uchar red\r\nproperty double "
      "z\r\nproperty short y\r\n"
      "property float x\r\nelement tristrips 1\r\nproperty list int int vertex_indices\r\nend_header\r\n"
      "0.5 2 7 8\r\n9 0 0 0\r\n9 0 0 1\r\n9 0 1 0\r\n9 0 1 1\r\n9 3 2 0\r\n8 0 1 2 3 -1 2 3 4\r\n";
  const TaggedSurface read = read_tagged_surface(scratch.put("a.ply", ply));
  EXPECT_EQ(read.space, "RAS");
  Triangles expected(3, 3);
  expected << 0, 1, 2, 2, 1, 3, 2, 3, 4;
  EXPECT_EQ(read.mesh.F, expected);
  EXPECT_EQ(read.mesh.V.row(4), Eigen::RowVector3d(0, 2, 3));
}

// Line ends of three kinds, a byte order mark, words behind a face: what editors and old programs leave.
TEST(SurfaceFormats, TextsOfOtherMachinesAreRead) {
  const Scratch scratch;
  foreign::vtk_write(scratch / "a.ply", ball(), "text");
  foreign::vtk_write(scratch / "a.obj", ball(), "");
  write_surface(scratch / "a.off", ball());
  scratch.put("a.stl",
              "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
              "endfacet\nendsolid a\n");
  for (const std::string name : {"a.ply", "a.obj", "a.off", "a.stl"}) {
    const std::string unix = scratch.get(name);
    const auto expected = soup(read_surface(scratch / name));
    for (const std::string end : {"\r\n", "\r"}) {
      std::string text;
      for (const char c : unix) text += c == '\n' ? end : std::string(1, c);
      EXPECT_EQ(soup(read_surface(scratch.put("b" + name, text))), expected) << name << end.size();
    }
    EXPECT_EQ(soup(read_surface(scratch.put("b" + name, "\xef\xbb\xbf" + unix))), expected) << name;
  }
  EXPECT_EQ(read_surface(scratch.put("c.obj", "v 0 0 0 # low\nv 1 0 0\nv 0 1 0\nf 1 2 3 # the only one\n"))
                .F.rows(),
            1);
}

TEST(SurfaceFormats, PlyFacesMayStandBeforeTheirVertices) {
  const Scratch scratch;
  const SurfaceMesh read = read_surface(scratch.put(
      "a.ply",
      "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\nelement vertex 3\n"
      "property float x\nproperty float y\nproperty float z\nend_header\n3 0 1 2\n0 0 0\n1 0 0\n0 1 0\n"));
  EXPECT_EQ(read.F.rows(), 1);
  EXPECT_EQ(read.V.row(2), Eigen::RowVector3d(0, 1, 0));
}

TEST(SurfaceFormats, VtkFieldDataOfStringsArePassedOver) {
  const Scratch scratch;
  for (const std::string form : {"text", "binary", "text4", "binary4"}) {
    foreign::vtk_write(scratch / "a.vtk", ball(), form);
    foreign::vtk_write(scratch / "b.vtk", ball(), "strings " + form);
    EXPECT_NE(scratch.get("b.vtk").find("string"), std::string::npos);
    EXPECT_EQ(soup(read_surface(scratch / "b.vtk")), soup(read_surface(scratch / "a.vtk"))) << form;
  }
}

TEST(SurfaceFormats, TitlesOfVtkFilesNameTheirSpace) {
  const Scratch scratch;
  foreign::vtk_write(scratch / "a.vtk", ball(), "binary");
  EXPECT_EQ(read_tagged_surface(scratch / "a.vtk").space, "RAS");
  foreign::vtk_write(scratch / "a.vtp", ball(), "text");
  std::string text = scratch.get("a.vtp");
  const std::size_t at = text.find("<Piece");
  ASSERT_NE(at, text.npos);
  text.insert(at,
              "<FieldData><Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">82 65 "
              "83 0</Array></FieldData>");
  EXPECT_EQ(read_tagged_surface(scratch.put("b.vtp", text)).space, "RAS");
  EXPECT_EQ(soup(foreign::vtk_surface(scratch / "b.vtp")), soup(read_surface(scratch / "b.vtp")));
}

TEST(SurfaceFormats, ATriangleOfVerticesThatAreNotThereIsNotWritten) {
  const Scratch scratch;
  SurfaceMesh mesh = ball();
  mesh.F(3, 1) = 7777;
  expect_error(ErrorKind::internal, "stl: triangle 3 uses vertex 7777 (report this)",
               [&] { write_surface(scratch / "a.stl", mesh); });
  expect_error(ErrorKind::internal, "mesh: triangle 3 uses vertex 7777 (report this)",
               [&] { write_surface(scratch / "a.obj", mesh); });
  Tets tets(1, 4);
  tets << 0, 1, 2, 9;
  for (const char* name : {"a.msh", "a.vtu"}) {
    expect_error(ErrorKind::internal, "mesh: row 0 uses vertex 9 (report this)", [&] {
      write_tets(scratch / name, PointsF::Zero(4, 3), tets, {}, {}, TetRegions{{0}, {"soft"}});
    });
  }
  EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

TEST(SurfaceFormats, WhatVtkCannotWriteIsSaid) {
  const Scratch scratch;
  expect_error(ErrorKind::io,
               "none/a.ply: VTK could not write it: Error opening PLY file (check the disk's free space)",
               [&] { vtk_files::write_ply(scratch / "none" / "a.ply", ball()); });
}

TEST(SurfaceFormats, UnusedVerticesGoAndEqualOnesMerge) {
  const Scratch scratch;
  const SurfaceMesh read = read_surface(
      scratch.put("a.obj", "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv -0.0 0 0\nv 1 1 0\nf 2 3 4\nf 5 3 6\n"));
  Triangles expected(2, 3);
  expected << 0, 1, 2, 0, 1, 3;
  EXPECT_EQ(read.F, expected);
  EXPECT_EQ(read.V.rows(), 4);
}

}  // namespace
}  // namespace ecorche::io
