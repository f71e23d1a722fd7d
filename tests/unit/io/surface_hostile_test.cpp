// SPDX-License-Identifier: Apache-2.0
// Bytes that nobody should have written, for every decoder of surfaces: a mesh whose triangles lie in it or
// Error{data}, and never more memory than the bytes can justify.
#include <gtest/gtest.h>

#include <sys/mman.h>
#include <zlib.h>

#include <cstdlib>
#include <functional>
#include <new>
#include <random>

#include "io/surface/gltf.hpp"
#include "io/surface/mesh_builder.hpp"
#include "io/surface/obj.hpp"
#include "io/surface/off.hpp"
#include "io/surface/ply.hpp"
#include "io/surface/stl.hpp"
#include "io/surface/surface_file.hpp"
#include "io/surface/vtk_legacy.hpp"
#include "io/surface/vtp.hpp"
#include "tests/unit/io/base64.hpp"
#include "tests/unit/io/foreign_surfaces.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/small_case.hpp"

namespace {
std::size_t largest_allocation = 0;
}

// Every allocation of this program passes here: the largest one tells whether a count was believed. Never
// inlined: gcc 12 takes one of them inlined beside the other by name for a mismatched pair.
[[gnu::noinline]] void* operator new(std::size_t size) {
  largest_allocation = std::max(largest_allocation, size);
  void* out = std::malloc(size == 0 ? 1 : size);
  if (out == nullptr) throw std::bad_alloc();
  return out;
}
[[gnu::noinline]] void operator delete(void* at) noexcept {
  std::free(at);
}
[[gnu::noinline]] void operator delete(void* at, std::size_t) noexcept {
  std::free(at);
}

namespace ecorche::io {
namespace {

struct Sample {
  std::string name, bytes;
  bool cut_is_wrong = true;  // a text may be cut between two lines and still be whole
};

SurfaceMesh decode(const std::string& name, std::string_view bytes) {
  const std::string extension = std::filesystem::path(name).extension().string();
  if (extension == ".ply") return ply::decode(bytes, name);
  if (extension == ".obj") return obj::decode(bytes, name);
  if (extension == ".off") return off::decode(bytes, name);
  if (extension == ".vtk") return vtk_legacy::decode(bytes, name);
  if (extension == ".vtp") return vtp::decode(bytes, name).mesh;
  return gltf::decode(bytes, name);
}

std::vector<Sample> samples() {
  const Scratch scratch;
  const SurfaceMesh mesh = box({-1.5, 2, 3.25}, {4, 5.125, 60});
  std::vector<Sample> out;
  const auto add = [&](const std::string& name, bool cut_is_wrong) {
    out.push_back({name, scratch.get(name), cut_is_wrong});
  };
  const auto by_vtk = [&](const std::string& name, const std::string& form, bool cut_is_wrong = true) {
    foreign::vtk_write(scratch / name, mesh, form);
    add(name, cut_is_wrong);
  };
  by_vtk("text.ply", "text", false);
  by_vtk("little.ply", "little");
  by_vtk("big.ply", "big");
  by_vtk("text.vtk", "text", false);
  by_vtk("binary.vtk", "binary", false);
  by_vtk("old.vtk", "binary4", false);
  by_vtk("strips.vtk", "strips binary", false);
  by_vtk("text.vtp", "text");
  by_vtk("raw.vtp", "raw", false);
  by_vtk("base64.vtp", "base64", false);
  by_vtk("zlib.vtp", "zlib", false);
  by_vtk("inline.vtp", "zlib64");
  for (const char* name : {"a.obj", "a.off"}) {
    write_surface(scratch / name, mesh);
    add(name, false);
  }
  write_surface(scratch / "a.glb", mesh);
  add("a.glb", true);
  foreign::assimp_write(scratch / "a.gltf", mesh, "gltf2");
  std::string text = scratch.get("a.gltf");
  // Its buffer into the file.
  for (const auto& entry : std::filesystem::directory_iterator(scratch.path())) {
    const std::string file = entry.path().filename().string();
    const std::size_t at = text.find("\"" + file + "\"");
    if (at != text.npos)
      text.replace(at + 1, file.size(), "data:application/octet-stream;base64," + base64(scratch.get(file)));
  }
  out.push_back({"a.gltf", text, true});
  return out;
}

// Three blocks of 12 bytes in a VTP's words of 64 bits: the first claims 2^64 - 1 packed bytes, and is whole.
std::string wrapping_blocks() {
  const std::string zeros(12, '\0');
  std::string stream(64, '\0');
  uLongf size = stream.size();
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(stream.data()), &size,
                     reinterpret_cast<const Bytef*>(zeros.data()), zeros.size()),
            Z_OK);
  stream.resize(size);
  const std::array<std::uint64_t, 6> head{3, 12, 12, ~std::uint64_t{0}, stream.size(), 0};
  // The words and the blocks are base64 texts of their own.
  return std::string(reinterpret_cast<const char*>(head.data()), sizeof head) + stream;
}

// True where a mesh came out.
bool survives(const Sample& sample, std::string_view bytes) {
  largest_allocation = 0;
  bool read = false;
  try {
    const SurfaceMesh mesh = decode(sample.name, bytes);
    read = true;
    EXPECT_GE(mesh.F.minCoeff(), 0);
    EXPECT_LT(mesh.F.maxCoeff(), mesh.V.rows());
    EXPECT_TRUE(mesh.V.allFinite());
  } catch (const Error& error) {
    EXPECT_EQ(static_cast<int>(error.kind()), static_cast<int>(ErrorKind::data)) << error.what();
  }
  EXPECT_LT(largest_allocation, std::size_t{24} << 20) << sample.name;
  return read;
}

TEST(HostileSurfaces, EveryPrefixIsRefusedOrWhole) {
  for (const Sample& sample : samples()) {
    SCOPED_TRACE(sample.name);
    for (std::size_t n = 0; n + 1 < sample.bytes.size(); ++n) {
      const bool read = survives(sample, std::string_view(sample.bytes).substr(0, n));
      // A file may end in newlines or closing tags that say nothing.
      if (sample.cut_is_wrong && n + 24 < sample.bytes.size()) {
        ASSERT_FALSE(read) << n;
      }
    }
    EXPECT_NO_THROW(decode(sample.name, sample.bytes));
  }
}

TEST(HostileSurfaces, FlippedBytesNeverHarm) {
  std::mt19937 random(23);
  for (const Sample& sample : samples()) {
    SCOPED_TRACE(sample.name);
    int read = 0;
    for (int round = 0; round < 1500; ++round) {
      std::string bytes = sample.bytes;
      for (int flips = 0; flips < 1 + round % 4; ++flips)
        bytes[random() % bytes.size()] = static_cast<char>(random());
      read += survives(sample, bytes) ? 1 : 0;
    }
    EXPECT_GT(read, 5);  // those that hit a coordinate: the decoder is met
  }
}

// Digits are where counts and indices stand in text.
TEST(HostileSurfaces, LyingNumbersNeverHarm) {
  std::mt19937 random(29);
  constexpr std::array<std::string_view, 8> lies{
      "-1", "4294967296", "9223372036854775807", "99999999999999999999", "1e308", "nan", "2147483647", "0"};
  for (const Sample& sample : samples()) {
    SCOPED_TRACE(sample.name);
    for (int round = 0; round < 1500; ++round) {
      std::string bytes = sample.bytes;
      const std::size_t start = random() % std::min<std::size_t>(bytes.size(), 4000);
      const std::size_t at = bytes.find_first_of("0123456789", start);
      if (at == bytes.npos) continue;
      const std::size_t end = std::min(bytes.find_first_not_of("0123456789", at), bytes.size());
      bytes.replace(at, end - at, lies[random() % lies.size()]);
      survives(sample, bytes);
    }
  }
}

TEST(HostileSurfaces, EveryMistakeIsNamed) {
  const auto refused = [](const std::string& name, const std::string& bytes, const std::string& part) {
    expect_error(ErrorKind::data, part, [&] { decode(name, bytes); });
  };
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  refused("a.ply", "PLY\n", "is no PLY: its first line is not 'ply'");
  refused("a.ply", "ply\nformat ascii 2.0\n", "a.ply:2: its version is '2.0', not 1.0");
  refused("a.ply", "ply\nformat ascii 1.0\nelement vertex -3\n", "a.ply:3: '-3' is no number of elements");
  refused("a.ply", "ply\nformat ascii 1.0\nproperty float x\n",
          "a.ply:3: a property stands before the first element");
  refused("a.ply", head + "property half w\n", "a.ply:7: no type is named 'half'");
  refused("a.ply", head + "dance\n", "a.ply:7: 'dance' is no keyword of a PLY header");
  refused("a.ply", head + face + "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "triangle 0 uses point 3 of 3");
  refused("a.ply", head + face + "0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n", "point 1 has the coordinate nan");
  refused("a.ply", head + face + "0 0 0\n1 0 1e10\n0 1 0\n3 0 1 2\n", "point 1 has the coordinate 1e+10");
  refused("a.ply", head + face + "0 0 0\n1 0 0\n0 1 0\n200 0 1 2\n",
          "a list of 200 values is longer than the file");
  refused("a.ply", head + face + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n7\n", "has 1 bytes more than it declares");
  refused("a.ply", "ply\nformat ascii 1.0\nelement vertex 999999999\nproperty float x\nend_header\n0\n",
          "says 999999999 of element 'vertex', which take 2 bytes each, but has 2 bytes left");
  refused("a.ply", head + "end_header\n0 0 0\n1 0 0\n0 1 0\n", "has no triangle");
  refused("a.obj", "v 0 0\n", "a.obj:1: expected a number, found ''");
  refused("a.obj", "v 0 0 0\nf 1 2 x\n", "a.obj:2: expected a whole number, found 'x'");
  refused("a.obj", "v 0 0 0\nf 1 -2 1\n", "a.obj:2: corner -2 is none of 1 vertices");
  refused("a.obj", "v 0 0 0\nf 1 2 3\n", "triangle 0 uses point 1 of 1");
  refused("a.obj", "v 0 0 0\nf 1 1\n", "a.obj:2: a face has fewer than three corners");
  refused("a.obj", "v 0 0 0\ncstype bspline\n",
          "'cstype' is no keyword of a polygonal OBJ (save the surface as polygons)");
  refused("a.obj", std::string("\x00\x01\x02", 3), "is no keyword of a polygonal OBJ");
  refused("a.off", "solid\n", "is no OFF: it does not begin with 'OFF'");
  refused("a.off", "4OFF\n1 1 0\n", "cannot be read (save it as a text OFF in three dimensions)");
  refused("a.off", "OFF BINARY\n1 1 0\n", "cannot be read");
  refused("a.off", "OFF\n3 1000000 0\n0 0 0\n1 0 0\n", "a.off:2: 1000000 is more than the file can hold");
  refused("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n", "ends before all that it declares");
  refused("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 2\n",
          "a.off:7: has more lines than it declares");
  const std::string vtk = "# vtk DataFile Version 4.2\nx\nASCII\nDATASET POLYDATA\n";
  refused("a.vtk", "# vtk DataFile\n", "is no legacy VTK file");
  refused("a.vtk", "# vtk DataFile Version 4.2\nx\nASCII\nDATASET UNSTRUCTURED_GRID\n",
          "holds 'unstructured_grid', no surface (save its surface as POLYDATA)");
  refused("a.vtk", vtk + "POINTS 1000 float\n0 0 0\n", "says 1000, more than the file can hold");
  refused("a.vtk", vtk + "POINTS 3 half\n0 0 0 0 0 0 0 0 0\n", "no type is named 'half'");
  refused("a.vtk", vtk + "POINTS 3 float\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n5 0 1 2\n",
          "cell 0 has more corners than its list");
  refused("a.vtk", vtk + "POINTS 3 float\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n3 0 1 7\n",
          "triangle 0 uses point 7 of 3");
  refused(
      "a.ply",
      "ply\nformat ascii 1.0\nelement face 1\nproperty list float int vertex_indices\nend_header\n3 0 1 2\n",
      "'float' counts no list");
  refused("a.ply",
          "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n0 0\n",
          "its vertices have no 'z'");
  refused("a.ply", "ply\nformat utf8 1.0\nend_header\n", "no format is named 'utf8'");
  refused("a.ply",
          "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float x\nend_header\n0 0\n",
          "property 'x' is declared twice");
  refused("a.ply", head + "element face 1\nproperty float q\nend_header\n0 0 0\n1 0 0\n0 1 0\n1\n",
          "its element 'face' has no list 'vertex_indices'");
  refused("a.vtk", vtk + "BANANAS 3\n", "'bananas' is no part of a surface");
  refused("a.vtk", vtk + "POINTS many float\n", "'many' is no count");
  const std::string binary = "# vtk DataFile Version 4.2\nx\nBINARY\nDATASET POLYDATA\n";
  const std::string fives =
      "# vtk DataFile Version 5.1\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n";
  refused("a.vtk", vtk + "FIELD f 1\na 1 1 variant\n7\n",
          "its field data are of type 'variant' (save it without field data)");
  refused("a.vtk",
          binary +
              "FIELD f 1\na 1 1 string\n\xc9"
              "abc",
          "a string of its field data is longer than the file");
  refused("a.vtk", binary + "FIELD f 1\na 1 1 string\n\x40", "a.vtk: ends before all that it declares");
  refused("a.vtk", binary + "POINTS 0 float\nPOLYGONS 1 4\n0123",
          "a.vtk: ends before all that it declares (save");
  refused("a.vtk", vtk + "POINTS 3 float\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n3 0 1 x\n",
          "expected a whole number, found 'x'");
  refused("a.vtk", vtk + "POINTS 3 float\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n9 0 1 2\n",
          "cell 0 has more corners than its list");
  refused("a.vtk", fives + "POLYGONS 2 3\nOFFSETS vtktypeint64\n0 9\nCONNECTIVITY vtktypeint64\n0 1 2\n",
          "cell 0 has more corners than its list (save");
  refused("a.vtk", fives + "POLYGONS 2 3\nOFFSETS vtktypeint64\n0 3\nCELLS vtktypeint64\n0 1 2\n",
          "lacks CONNECTIVITY of its cells");
  refused("a.vtk", "# vtk DataFile Version 4.2", "a.vtk: its header does not end");
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
  refused("a.ply",
          ply + "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n3 0 0 half\n",
          "'half' is no whole number");
  refused("a.ply", ply + "end_header\n0 zero 0\n", "'zero' is no number");
  refused("a.ply", ply + "end_header\n0 00000\n", "a.ply: ends before all that it declares");
  refused(
      "a.ply",
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty list uchar int a\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n\x01"
      "0123456789012",
      "a.ply: ends before all that it declares (save");
  refused("a.ply", ply + "element vertex 1\nend_header\n", "element 'vertex' is declared twice");
  refused("a.ply", "ply\nelement vertex 1\nend_header\n", "its header lacks 'format'");
  refused("a.off", "OFF\n1 1 0\n0 0 0\n99 0 0 0\n", "a.off:4: a face has 99 corners");
  refused("a.off", "OFF\n1 1 0\n0 0 0\n0 0 0 0\n", "a.off:4: a face has 0 corners");
  refused("a.vtk", vtk + "POINTS 3 float\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 8\n3 0 1 2 0 0 0 0\n",
          "its cells are fewer than their list");
  refused("a.vtp", "<VTKFile type=\"PolyData\"><AppendedData encoding=\"raw\">",
          "its appended data do not begin");
  refused("a.vtk", "# vtk DataFile Version 4.2\nx\nEBCDIC\n", "is neither ASCII nor BINARY: 'ebcdic'");
  refused("a.vtk", "# vtk DataFile Version 4.2\nx\nASCII\nFIELD x\n", "its fourth line is no DATASET");
  refused("a.vtk", vtk + "POINTS 1 float or so\n0 0 0\n", "has words where a line should end");
  refused("a.vtk", vtk + "POINTS 1 float\n0 0 0\nPOINTS 1 float\n0 0 0\n", "has POINTS twice");
  refused("a.vtp", "<VTKFile type=\"UnstructuredGrid\"></VTKFile>", "is no VTK PolyData");
  const auto vtp = [](const std::string& points, const std::string& offsets) {
    return "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"3\" "
           "NumberOfPolys=\"1\"><Points><DataArray "
           "type=\"Float32\" " +
           points +
           "</DataArray></Points><Polys><DataArray type=\"Int32\" Name=\"connectivity\" "
           "format=\"ascii\">0 1 2</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">" +
           offsets + "</DataArray></Polys></Piece></PolyData></VTKFile>";
  };
  const std::string nine = "0 0 0 1 0 0 0 1 0";
  refused("a.vtp", vtp("NumberOfComponents=\"2\" format=\"ascii\">" + nine, "3"),
          "its points have not 3 coordinates");
  refused("a.vtp", vtp("NumberOfComponents=\"3\" format=\"hex\">" + nine, "3"),
          "an array is stored as 'hex'");
  refused("a.vtp", vtp("NumberOfComponents=\"3\" format=\"ascii\">" + nine + " 7", "3"),
          "an array is larger than its counts say");
  refused("a.vtp", vtp("NumberOfComponents=\"3\" format=\"binary\">/////w==", "3"),
          "a.vtp: an array is larger than its counts say");
  const auto packed = [&](const std::vector<std::uint32_t>& counts, const std::string& blocks) {
    std::string text =
        vtp("NumberOfComponents=\"3\" format=\"binary\">" +
                base64(std::string(reinterpret_cast<const char*>(counts.data()), 4 * counts.size())) +
                base64(blocks),
            "3");
    return text.insert(text.find("type="), "compressor=\"vtkZLibDataCompressor\" ");
  };
  refused("a.vtp", packed({3, 12, 12, 1, 1, 0xfffffff}, "ab"),
          "a.vtp: an array of 268435457 bytes ends early");
  refused("a.vtp", packed({1, 36, 0, 9}, "123456789"), "its compressed arrays are damaged");
  // Two whole blocks of 2^31 bytes; and sizes of packed blocks that together wrap round, with a whole stream
  // in the first of them.
  refused("a.vtp", packed({3, 0x80000000, 0, 1, 1, 1}, "a"), "a.vtp: an array is larger than its counts say");
  std::string wide = vtp("NumberOfComponents=\"3\" format=\"binary\">" + base64(wrapping_blocks()), "3");
  wide.insert(wide.find("type="), "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\" ");
  EXPECT_LT(wide.size(), 640U);
  refused("a.vtp", wide, "a.vtp: the packed sizes of an array are more than can be counted (save");
  refused("a.vtp", packed({9, 12, 12, 1, 1, 1, 1, 1, 1, 1, 1, 1}, "123456789"),
          "a.vtp: an array is larger than its counts say (save");
  std::string bomb = packed({1, 36000, 0, 1}, "a");
  refused("a.vtp", bomb.replace(bomb.find("Points=\"3\""), 10, "Points=\"3000\""),
          "1 packed bytes cannot hold 36000");
  refused("a.vtp", vtp("NumberOfComponents=\"3\" format=\"binary\">AAAA", "3"),
          "an array of 4 bytes ends early");
  refused("a.vtp", vtp("NumberOfComponents=\"3\" format=\"ascii\">" + nine, "9"),
          "a cell ends at corner 9 of 3");
  refused("a.vtp", vtp("NumberOfComponents=\"3\" format=\"appended\" offset=\"999\">", "3"),
          "an array begins at '999', outside the file");
  std::string odd = vtp("NumberOfComponents=\"3\" format=\"ascii\">" + nine, "3");
  odd.replace(odd.find("Float32"), 7, "Float33");
  refused("a.vtp", odd, "an array is of type 'Float33'");
  odd.replace(odd.find("Points=\"3\""), 10, "Points=\"999999999\"");
  refused("a.vtp", odd, "NumberOfPoints is '999999999', more than the file can hold");
  odd = vtp("NumberOfComponents=\"3\" format=\"ascii\">" + nine, "3");
  refused("a.vtp", odd.replace(odd.find("0 1 2"), 5, "0 1 9"), "a.vtp: a cell uses point 9 of 3");
  refused("a.vtp", "<!DOCTYPE x [<!ENTITY a \"b\">]><x/>", "has a DOCTYPE");
  refused("a.vtp", "<VTKFile", "is no XML: unclosed token");
  const Scratch scratch;
  foreign::vtk_write(scratch / "a.vtp", box({0, 0, 0}, {1, 1, 1}), "lz4");
  refused("a.vtp", scratch.get("a.vtp"),
          "its arrays are packed by vtkLZ4DataCompressor (save it packed by zlib, or not packed)");
}

TEST(HostileSurfaces, PointsAreCountedIn32Bits) {
  files::Budget budget(0, {}, "a.obj");
  MeshBuilder mesh(budget, 2);
  mesh.add_point({0, 0, 0});
  mesh.add_point({1, 0, 0});
  expect_error(ErrorKind::data, "a.obj: has more points than can be counted", [&] {
    mesh.add_point({2, 0, 0});
  });
}

// Nobody touches the pages of this file: its size alone is asked for.
TEST(HostileSurfaces, NoGltfIsLargerThanItsOwnCounts) {
  const std::size_t size = (std::size_t{1} << 32) + 1;
  void* pages = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  ASSERT_NE(pages, MAP_FAILED);
  const std::string_view file(static_cast<const char*>(pages), size);
  expect_error(ErrorKind::data, "a.glb: is larger than glTF can be", [&] { gltf::decode(file, "a.glb"); });
  ::munmap(pages, size);
}

// A polygon may have as many corners as it likes while it is convex; a hollow one is sought through.
TEST(HostileSurfaces, EndlessPolygonsEnd) {
  std::string star = "";
  std::string corners = "f";
  for (int i = 0; i < 2000; ++i) {
    const double angle = 2 * M_PI * i / 2000, radius = i % 2 == 0 ? 1 : 2;
    star += "v " + std::to_string(radius * std::cos(angle)) + " " + std::to_string(radius * std::sin(angle)) +
            " 0\n";
    corners += " " + std::to_string(i + 1);
  }
  expect_error(ErrorKind::data, "has a polygon of 2000 corners that is not convex (cut it into triangles)",
               [&] { obj::decode(star + corners + "\n", "a.obj"); });
}

}  // namespace
}  // namespace ecorche::io
