// SPDX-License-Identifier: Apache-2.0
// Tets out of a .vtu: what we write ourselves, what others may, and bytes of every other kind.
#include "io/surface/vtu.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/two_tets.hpp"

namespace ecorche::io {
namespace {

std::string written(const Scratch& scratch) {
  write_tets(scratch / "a.vtu", points(), two(),
             {{"displacement", 3, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15.5F}},
              {"heat", 1, {1, 2, 3, 4, 5}}},
             {{"label", 1, {7, 8}}});
  return scratch.get("a.vtu");
}

// Two pieces in text, as VTK writes them, the second without `heat`.
std::string text(const std::string& types, const std::string& corners) {
  const auto piece = [&](const std::string& arrays) {
    return "<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><PointData>" + arrays +
           "</PointData><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">"
           "0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells><DataArray type=\"Int64\" "
           "Name=\"connectivity\" "
           "format=\"ascii\">" +
           corners + "</DataArray><DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4</DataArray>" +
           "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">" + types +
           "</DataArray></Cells></Piece>";
  };
  const std::string moved =
      "<DataArray type=\"Float32\" Name=\"displacement\" NumberOfComponents=\"3\" format=\"ascii\">"
      "1 1 1 2 2 2 3 3 3 4 4 4</DataArray>";
  return "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>" +
         piece(moved + "<DataArray type=\"Float32\" Name=\"heat\" format=\"ascii\">1 2 3 4</DataArray>") +
         piece(moved) + "</UnstructuredGrid></VTKFile>";
}

TEST(Vtu, ComesBackAsItWasWritten) {
  const Scratch scratch;
  written(scratch);
  const TetFile read = read_tets(scratch / "a.vtu");
  EXPECT_EQ(read.V, points());
  EXPECT_EQ(read.T, two());
  ASSERT_EQ(read.point_data.size(), 2u);
  EXPECT_EQ(read.point_data[0].name, "displacement");
  EXPECT_EQ(read.point_data[0].components, 3);
  EXPECT_EQ(read.point_data[0].values.back(), 15.5F);
  EXPECT_EQ(read.point_data[1].values, (std::vector<float>{1, 2, 3, 4, 5}));
  ASSERT_EQ(read.cell_data.size(), 1u);
  EXPECT_EQ(read.cell_data[0].name, "label");
  EXPECT_EQ(read.cell_data[0].values, (std::vector<float>{7, 8}));
}

TEST(Vtu, PiecesFollowOneAnother) {
  const TetFile read = vtu::decode(text("10", "0 1 2 3"), "a.vtu");
  EXPECT_EQ(read.V.rows(), 8);
  EXPECT_EQ(read.T(1, 0), 4);
  ASSERT_EQ(read.point_data.size(), 1u) << "heat is not in every piece";
  EXPECT_EQ(read.point_data[0].values.size(), 24u);
}

TEST(Vtu, WhatIsNoTetIsRefused) {
  const auto refused = [](const std::string& bytes, const std::string& part) {
    expect_error(ErrorKind::data, part, [&] { vtu::decode(bytes, "a.vtu"); });
  };
  refused(text("12", "0 1 2 3"), "a.vtu: cell 0 is no tet (save its tets alone)");
  refused(text("10", "0 1 2 4"), "a.vtu: a cell uses point 4 of 4");
  refused(text("10", "0 1 2"), "says 4 connectivity of cells, but has 3");
  refused("<VTKFile type=\"PolyData\"></VTKFile>", "is no VTK UnstructuredGrid");
  refused("<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid></UnstructuredGrid></VTKFile>", "has no tet");
  std::string odd = text("10", "0 1 2 3");
  odd.replace(odd.find("1 2 3 4<"), 7, "1 2 nan");
  refused(odd, "says 4 values of 'heat', but has 3");
  odd.replace(odd.find("1 2 nan"), 7, "1 nan 3 4");
  refused(odd, "holds a number that is not finite");
  odd = text("10", "0 1 2 3");
  odd.replace(odd.find("Name=\"connectivity\""), 19, "Name=\"connexion\"");
  refused(odd, "its cells have no connectivity");
  odd = text("10", "0 1 2 3");
  odd.replace(odd.find("NumberOfComponents=\"3\" format=\"ascii\">1 1"), 22, "NumberOfComponents=\"0\"");
  refused(odd, "array 'displacement' has '0' components");
  const Scratch scratch;
  expect_error(ErrorKind::data, "'.msh' tets cannot be read (give a .vtu)",
               [&] { read_tets(scratch / "a.msh"); });
  expect_error(ErrorKind::missing_input, "none.vtu", [&] { read_tets(scratch / "none.vtu"); });
}

// Any change of the bytes is refused or read as other numbers: no crash, and no tet of nodes that are not
// there.
TEST(Vtu, HostileBytes) {
  const Scratch scratch;
  const std::string good = written(scratch);
  const auto try_it = [](const std::string& bytes) {
    try {
      const TetFile read = vtu::decode(bytes, "a.vtu");
      EXPECT_LT(read.T.maxCoeff(), read.V.rows());
      EXPECT_GE(read.T.minCoeff(), 0);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::data) << error.what();
    }
  };
  const std::size_t raw = good.find('_', good.find("<AppendedData"));
  ASSERT_NE(raw, good.npos);
  std::size_t refused = 0;
  for (std::size_t cut = 0; cut < raw + 150; cut += cut < raw ? 17 : 1) {
    EXPECT_THROW(vtu::decode(good.substr(0, cut), "a.vtu"), Error) << cut;
    ++refused;
  }
  EXPECT_GT(refused, 100u);
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ (at % 2 == 0 ? 0x81 : 0x10));
    try_it(bad);
  }
}

}  // namespace
}  // namespace ecorche::io
