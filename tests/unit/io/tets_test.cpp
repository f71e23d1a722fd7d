// SPDX-License-Identifier: Apache-2.0
// Tets for other programs: the gate and the sets. meshio reads the files in tets_elsewhere.py.
#include <gtest/gtest.h>

#include "io/surface/surface_file.hpp"
#include "io/surface/tet_formats.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/two_tets.hpp"

namespace ecorche::io {
namespace {

TEST(TetFormats, McnpIsInCentimetresWithNumberedSets) {
  const Scratch scratch;
  write_tets(scratch / "a.mcnp.inp", points(), two(), {}, {}, {{0, 2}, {"soft", "unused", "femur"}});
  EXPECT_EQ(
      scratch.get("a.mcnp.inp"),
      "*Heading\n** ecorche, patient LPS, centimetres\n** material 1: soft\n** material 2: femur\n"
      "*Part, name=Part-body_1\n*Node\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n5, 1, 1, 1.0125\n"
      "*Element, type=C3D4\n1, 1, 2, 3, 4\n2, 2, 3, 4, 5\n*Elset, elset=Set-material_tally_001\n1\n"
      "*Elset, elset=Set-material_tally_002\n2\n*Solid Section, elset=Set-material_tally_001, "
      "material=Material-soft_001\n,\n"
      "*Solid Section, elset=Set-material_tally_002, material=Material-femur_002\n,\n*End Part\n"
      "*Assembly, name=Assembly\n*Instance, name=Part-body_1-1, part=Part-body_1\n*End Instance\n*End "
      "Assembly\n"
      "*Material, name=Material-soft_001\n*Material, name=Material-femur_002\n");
}

TEST(TetFormats, DegenerateTetsAreRefusedAndListed) {
  const Scratch scratch;
  const auto refused = [&](const PointsF& V, const Tets& T, const std::string& part) {
    expect_error(ErrorKind::refused, part, [&] { write_tets(scratch / "a.mcnp.inp", V, T, {}, {}); });
    EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
  };
  Tets inverted = two();
  std::swap(inverted(1, 0), inverted(1, 1));
  refused(points(), inverted,
          "a.mcnp.inp: 1 of 2 tets are below 0.001 mm3 or 0.5 deg: 2 (-335.4 mm3, 70.2 deg, at 5.0 5.0 5.0) "
          "(pose less,");
  PointsF flat = points();
  flat.row(3) << 3, 3, 0.01F;  // 0.17 mm3, and flatter than 0.5 degrees
  Tets T(1, 4);
  T << 0, 1, 2, 3;
  refused(flat, T, "1 of 1 tets are below 0.001 mm3 or 0.5 deg: 1 (0.1667 mm3, 0.1");
  Tets many(30, 4);
  for (int t = 0; t < 30; ++t) many.row(t) << 1, 0, 2, 3;
  const auto error = error_of([&] { write_tets(scratch / "a.mcnp.inp", points(), many, {}, {}); });
  ASSERT_TRUE(error);
  EXPECT_NE(error->problem().find(", 10 ("), std::string::npos);
  EXPECT_EQ(error->problem().find(", 11 ("), std::string::npos);
  EXPECT_TRUE(error->problem().ends_with(", ..."));
  EXPECT_NO_THROW(write_tets(scratch / "a.inp", points(), many, {}, {}));  // Abaqus itself says what it takes
}

// The least angle of a corner of a cube is atan(sqrt 2): known, as is that of a regular tet.
TEST(TetFormats, TheGateMeasuresDihedralAngles) {
  PointsF V(4, 3);
  V << 1, 1, 1, 1, -1, -1, -1, 1, -1, -1, -1, 1;
  Tets T(1, 4);
  T << 0, 1, 2, 3;  // inverted, so that it is listed
  expect_error(ErrorKind::refused, "1 (-2.667 mm3, 70.5 deg, at 0.0 0.0 0.0)",
               [&] { tet_formats::refuse_degenerate(V, T, "a"); });
  T << 0, 2, 1, 3;
  V << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  expect_error(ErrorKind::refused, "1 (-0.1667 mm3, 54.7 deg",
               [&] { tet_formats::refuse_degenerate(V, T, "a"); });
}

TEST(TetFormats, WrongCallsAreRefused) {
  const Scratch scratch;
  Tets wrong = two();
  wrong(1, 3) = 5;
  for (const char* name : {"a.msh", "a.ele", "a.inp", "a.mcnp.inp"}) {
    expect_error(ErrorKind::internal, "row 1 uses vertex 5",
                 [&] { write_tets(scratch / name, points(), wrong, {}, {}); });
    expect_error(ErrorKind::internal, "2 labels up to 3 for 2 tets and 1 names", [&] {
      write_tets(scratch / name, points(), two(), {}, {}, {{0, 3}, {"soft"}});
    });
  }
  EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

}  // namespace
}  // namespace ecorche::io
