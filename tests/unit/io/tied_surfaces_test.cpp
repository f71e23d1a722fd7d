// SPDX-License-Identifier: Apache-2.0
// The scan's surfaces of a posed folder, and files that are none.
#include "io/surface/tied_surfaces.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "io/surface/surface_file.hpp"
#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

TiedSurfaces two_triangles() {
  TiedSurfaces out;
  out.V.resize(5, 3);
  out.V << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 7.25F, 1e-7F, -3;  // two in one place stay two
  out.F.resize(2, 3);
  out.F << 0, 1, 2, 3, 1, 4;
  out.tet = {-1, -1, 20'000'001, 3, 0};
  out.share.setZero(5, 4);
  out.share.row(2) << 0.25F, -0.5F, 1, 0.25F;
  return out;
}

TEST(TiedSurfaces, ComeBackAsTheyWereWritten) {
  const Scratch scratch;
  write_tied_surfaces(scratch / "a.vtp", two_triangles());
  const TiedSurfaces read = read_tied_surfaces(scratch / "a.vtp"), wrote = two_triangles();
  EXPECT_EQ(read.V, wrote.V);
  EXPECT_EQ(read.F, wrote.F);
  EXPECT_EQ(read.tet, wrote.tet);
  EXPECT_EQ(read.share, wrote.share);
  EXPECT_EQ(read_surface(scratch / "a.vtp").F.rows(), 2);  // a surface like any other
}

TEST(TiedSurfaces, WhatDoesNotFitIsRefused) {
  const Scratch scratch;
  const auto refused = [&](const TiedSurfaces& surfaces, const std::string& part) {
    write_tied_surfaces(scratch / "a.vtp", surfaces);
    expect_error(ErrorKind::data, part, [&] { read_tied_surfaces(scratch / "a.vtp"); });
  };
  TiedSurfaces wrong = two_triangles();
  wrong.tet[1] = -2;
  refused(wrong, "a vertex hangs on tet -2");
  wrong = two_triangles();
  wrong.share(0, 0) = std::numeric_limits<float>::quiet_NaN();
  refused(wrong, "has a coordinate or share that is not finite");
  SurfaceMesh plain;
  plain.V = two_triangles().V.cast<double>();
  plain.F = two_triangles().F;
  write_surface(scratch / "b.vtp", plain);
  expect_error(ErrorKind::data, "has no array 'share'", [&] { read_tied_surfaces(scratch / "b.vtp"); });
  write_surface(scratch / "c.vtp", plain, {{"share", 1, {1, 2, 3, 4, 5}}});
  expect_error(ErrorKind::data, "shares", [&] { read_tied_surfaces(scratch / "c.vtp"); });
  write_surface(scratch / "f.vtp", plain, {{"share", 4, std::vector<float>(20, 0.25F)}});
  expect_error(ErrorKind::data, "'tet'", [&] { read_tied_surfaces(scratch / "f.vtp"); });
  const std::string head = "<VTKFile type=\"PolyData\"><PolyData>", tail = "</PolyData></VTKFile>";
  scratch.put("d.vtp", head + tail);
  expect_error(ErrorKind::data, "is not one piece of surfaces",
               [&] { read_tied_surfaces(scratch / "d.vtp"); });
  scratch.put("e.vtp", head +
                           "<Piece NumberOfPoints=\"0\" NumberOfPolys=\"1\"><Polys><DataArray type=\"Int64\" "
                           "Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray></Polys></Piece>" +
                           tail);
  expect_error(ErrorKind::data, "a triangle uses vertex 0 of 0",
               [&] { read_tied_surfaces(scratch / "e.vtp"); });
}

}  // namespace
}  // namespace ecorche::io
