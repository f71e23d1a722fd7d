// SPDX-License-Identifier: Apache-2.0
#include "preprocess/voxel/voxelize.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <numeric>
#include <random>
#include <string>

#include "preprocess/voxel/open_surface.hpp"
#include "tests/support/triangle_distance.hpp"
#include "tests/unit/voxel/shapes.hpp"
#include "tests/unit/voxel/slow_winding.hpp"

namespace ecorche::voxel {
namespace {

/// Whether the triangle meets the box of half-widths `half` about `centre`, by thirteen axes in doubles.
bool meets(const Eigen::Vector3d (&triangle)[3], const Eigen::Vector3d& centre, double half) {
  Eigen::Vector3d p[3], edge[3];
  for (int n = 0; n < 3; ++n) p[n] = triangle[n] - centre;
  const auto apart = [&](const Eigen::Vector3d& axis) {
    const double reach = half * axis.cwiseAbs().sum();
    const double at[3] = {axis.dot(p[0]), axis.dot(p[1]), axis.dot(p[2])};
    return std::min({at[0], at[1], at[2]}) > reach || std::max({at[0], at[1], at[2]}) < -reach;
  };
  for (int a = 0; a < 3; ++a)
    if (apart(Eigen::Vector3d::Unit(a))) return false;
  for (int n = 0; n < 3; ++n) edge[n] = p[(n + 1) % 3] - p[n];
  if (apart(edge[0].cross(edge[1]))) return false;
  for (const Eigen::Vector3d& e : edge)
    for (int a = 0; a < 3; ++a)
      if (apart(e.cross(Eigen::Vector3d::Unit(a)))) return false;
  return true;
}

/// What a voxel must be, or nothing where snapping to 1/256 voxel may decide either way.
enum class Truth : std::uint8_t { in, out, unsure };

Truth truth(const SurfaceMesh& surface, const Eigen::Vector3d& centre, double voxel) {
  bool may_touch = false;
  for (Eigen::Index f = 0; f < surface.F.rows(); ++f) {
    const Eigen::Vector3d t[3] = {surface.V.row(surface.F(f, 0)), surface.V.row(surface.F(f, 1)),
                                  surface.V.row(surface.F(f, 2))};
    if (meets(t, centre, voxel * (0.5 - 1.0 / 200))) return Truth::in;
    may_touch = may_touch || meets(t, centre, voxel * (0.5 + 1.0 / 200));
  }
  if (std::abs(generalized_winding(surface, centre)) > 0.5) return Truth::in;
  return may_touch ? Truth::unsure : Truth::out;
}

template <class Visit>
void for_each_voxel(const Image& image, Visit&& visit) {
  const std::span<const std::uint16_t> labels = image.scalars<std::uint16_t>();
  std::size_t n = 0;
  for (int k = 0; k < image.grid.size[2]; ++k)
    for (int j = 0; j < image.grid.size[1]; ++j)
      for (int i = 0; i < image.grid.size[0]; ++i) {
        const std::array<double, 3> p = image.grid.point(i, j, k);
        visit(Eigen::Vector3d(p[0], p[1], p[2]), labels[n++]);
      }
}

std::size_t count(const Image& image, std::uint16_t label) {
  const std::span<const std::uint16_t> labels = image.scalars<std::uint16_t>();
  return static_cast<std::size_t>(std::count(labels.begin(), labels.end(), label));
}

void expect_label_rule(const Case& patient, double voxel) {
  const Image image = voxelize(patient, {.voxel_mm = voxel}, {});
  std::size_t sure = 0, all = 0;
  for_each_voxel(image, [&](const Eigen::Vector3d& p, std::uint16_t label) {
    ++all;
    std::vector<std::uint16_t> claims;
    bool unsure = false;
    for (std::size_t b = 0; b < patient.bones.size(); ++b) {
      const Truth t = truth(patient.bones[b].surface, p, voxel);
      if (t == Truth::in) claims.push_back(static_cast<std::uint16_t>(first_bone + b));
      unsure = unsure || t == Truth::unsure;
    }
    const Truth skin = truth(patient.skin, p, voxel);
    if (unsure || (claims.empty() && skin == Truth::unsure)) return;
    ++sure;
    std::uint16_t expected = skin == Truth::in ? soft : outside;
    double best = 1e300;
    for (const std::uint16_t claim : claims) {
      const SurfaceMesh& surface = patient.bones[static_cast<std::size_t>(claim - first_bone)].surface;
      const double distance = test::surface_distance(p, surface), d = distance * distance;
      if (d < best - 1e-9 * voxel * voxel) {
        best = d;
        expected = claim;
      }
    }
    ASSERT_EQ(label, expected) << p.transpose();
  });
  EXPECT_GT(static_cast<double>(sure), 0.9 * static_cast<double>(all));
}

SurfaceMesh turned(SurfaceMesh mesh, std::mt19937& random) {
  std::normal_distribution<double> draw;
  const Eigen::Matrix3d r = Eigen::Quaterniond(draw(random), draw(random), draw(random), draw(random))
                                .normalized()
                                .toRotationMatrix();
  mesh.V = (mesh.V * r.transpose()).eval();
  return mesh;
}

SurfaceMesh tetrahedron(double size) {
  SurfaceMesh mesh;
  mesh.V.resize(4, 3);
  mesh.V << 0, 0, 0, size, 0, 0, 0, size, 0, 0, 0, size;
  mesh.F.resize(4, 3);
  mesh.F << 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3;
  return mesh;
}

TEST(Voxelize, RandomTetrahedraEqualBruteForce) {
  std::mt19937 random(11);
  for (int n = 0; n < 8; ++n) {
    SCOPED_TRACE(n);
    expect_label_rule(shapes::body(turned(tetrahedron(10), random)), 0.8);
  }
}

TEST(Voxelize, BodyWithBonesEqualsBruteForce) {
  std::mt19937 random(5);
  // A bone within, one that sticks out, one thinner than a voxel, and two that overlap.
  expect_label_rule(
      shapes::body(shapes::ellipsoid({0, 0, 0}, {12, 9, 15}, 4),
                   {shapes::ellipsoid({-2, 0, -4}, {3, 3, 5}, 3), shapes::box({2, -1, -1}, {14, 1, 1}),
                    turned(shapes::box({-6, -6, 7}, {6, 6, 7.05}), random),
                    shapes::ellipsoid({-2, 1, -7}, {4, 3, 3}, 3)}),
      0.9);
}

TEST(Voxelize, PlateThinnerThanAVoxelIsWhole) {
  const Case patient =
      shapes::body(shapes::box({0, 0, 0}, {20, 20, 20}), {shapes::box({4, 4, 10.2}, {16, 16, 10.25})});
  const Image image = voxelize(patient, {.voxel_mm = 1}, {});
  EXPECT_GE(count(image, first_bone), std::size_t{12 * 12});
  for_each_voxel(image, [&](const Eigen::Vector3d& p, std::uint16_t label) {
    if (p[0] > 4 && p[0] < 16 && p[1] > 4 && p[1] < 16 && std::abs(p[2] - 10.225) < 0.45) {
      EXPECT_EQ(label, first_bone) << p.transpose();
    }
  });
}

TEST(Voxelize, TouchingBonesShareTheirWallByTheRule) {
  // The wall lies on voxel centres (the image is centred on the bounds): equal distances go to the lower
  // index.
  const Case patient =
      shapes::body(shapes::box({-10, -10, -10}, {10, 10, 10}),
                   {shapes::box({-6, -5, -5}, {0, 5, 5}), shapes::box({0, -5, -5}, {6, 5, 5})});
  const Image image = voxelize(patient, {.voxel_mm = 1}, {});
  for_each_voxel(image, [&](const Eigen::Vector3d& p, std::uint16_t label) {
    if (p.cwiseAbs().maxCoeff() < 4) {
      EXPECT_EQ(label, p[0] < 0.5 ? first_bone : first_bone + 1) << p.transpose();
    }
  });
}

TEST(Voxelize, BoneOutsideTheSkinIsOfTheBody) {
  const Image image =
      voxelize(shapes::body(shapes::box({0, 0, 0}, {10, 10, 10}), {shapes::box({20, 0, 0}, {24, 4, 4})}),
               {.voxel_mm = 1}, {});
  EXPECT_EQ(count(image, first_bone), 5U * 5 * 5);
}

TEST(Voxelize, OneEmptyVoxelAllRound) {
  const Image image = voxelize(shapes::body(shapes::box({0, 0, 0}, {8, 4, 2})), {.voxel_mm = 1}, {});
  EXPECT_EQ(image.grid.size, (std::array<std::int32_t, 3>{11, 7, 5}));
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 7; ++j)
      for (int i = 0; i < 11; ++i) {
        const bool rim = i == 0 || j == 0 || k == 0 || i == 10 || j == 6 || k == 4;
        EXPECT_EQ(image.scalars<std::uint16_t>()[image.grid.offset(i, j, k)], rim ? outside : soft);
      }
}

struct Said {
  std::vector<std::string> warnings;
  Context context() {
    Context c;
    c.log = [this](LogLevel level, std::string_view line) {
      if (level == LogLevel::warning) warnings.emplace_back(line);
    };
    return c;
  }
};

TEST(Voxelize, SurfaceWithASlitIsFilled) {
  SurfaceMesh sphere = shapes::ellipsoid({0, 0, 0}, {10, 10, 10}, 16);  // triangles of about a voxel
  const Image whole = voxelize(shapes::body(sphere), {.voxel_mm = 1}, {});
  sphere.F.conservativeResize(sphere.F.rows() - 1, 3);
  Said said;
  const Image slit = voxelize(shapes::body(sphere), {.voxel_mm = 1}, said.context());
  EXPECT_EQ(slit.bytes, whole.bytes);
  ASSERT_EQ(said.warnings.size(), 1U);
  EXPECT_NE(said.warnings[0].find("skin: the surface has open edges"), std::string::npos) << said.warnings[0];
}

TEST(Voxelize, BoneWithAWideHoleKeepsItsShellAndSaysSo) {
  SurfaceMesh sphere = shapes::ellipsoid({0, 0, 0}, {10, 10, 10}, 16);
  sphere.F.conservativeResize(sphere.F.rows() - 64, 3);
  Said said;
  const Image image = voxelize(shapes::body(shapes::box({-15, -15, -15}, {15, 15, 15}), {sphere}),
                               {.voxel_mm = 1}, said.context());
  const std::array<double, 3> middle = image.grid.index({0, 0, 0});
  EXPECT_EQ(image.scalars<std::uint16_t>()[image.grid.offset(static_cast<int>(std::lround(middle[0])),
                                                             static_cast<int>(std::lround(middle[1])),
                                                             static_cast<int>(std::lround(middle[2])))],
            soft);
  EXPECT_GT(count(image, first_bone), 800U);
  ASSERT_EQ(said.warnings.size(), 1U);
  EXPECT_NE(said.warnings[0].find("only the voxels that it touches count"), std::string::npos)
      << said.warnings[0];
}

TEST(OpenSurface, WhatIsLostIsWhatAllWindingNumbersSay) {
  // Closed but for a slit, with a cap cut off, a bowl, and a pipe that is open at both ends.
  for (const int cut : {1, 64, 500, -1}) {
    SurfaceMesh surface = shapes::ellipsoid({0, 0, 0}, {10, 8, 12}, 16);
    if (cut > 0) {
      surface.F.conservativeResize(surface.F.rows() - cut, 3);
    } else {
      surface = shapes::box({-6, -5, -12}, {6, 5, 12});
      surface.F.conservativeResize(8, 3);  // without the walls below and above
    }
    const ImageGrid grid =
        voxelize(shapes::body(shapes::box({-15, -15, -15}, {15, 15, 15}), {}), {.voxel_mm = 1}, {}).grid;
    VoxelMask mask = rasterize(snap(surface, grid), false, 1, {});
    const OpenInside found = mark_inside_open(surface, grid, mask, {});
    double kept = 0, lost = 0;
    for (int k = mask.low[2]; k < mask.low[2] + mask.size[2]; ++k) {
      for (int j = mask.low[1]; j < mask.low[1] + mask.size[1]; ++j) {
        for (int i = mask.low[0]; i < mask.low[0] + mask.size[0]; ++i) {
          if (mask.is_touched(i, j, k)) continue;
          const std::array<double, 3> p = grid.point(i, j, k);
          if (std::abs(generalized_winding(surface, {p[0], p[1], p[2]})) < 0.5) continue;
          (mask.is_inside(i, j, k) ? kept : lost) += 1;
        }
      }
    }
    // In the mouth of the bowl the surface is seen along two axes only.
    EXPECT_NEAR(found.expected_ml, 1e-3 * (kept + lost), (cut == 500 ? 0.1e-3 : 0.03e-3) * (kept + lost))
        << cut;
    EXPECT_NEAR(found.lost, lost / (kept + lost), 0.02) << cut;
    EXPECT_EQ(found.lost > OpenInside::most_lost, cut != 1) << cut;
  }
}

TEST(Voxelize, DefaultVoxelIsTheFinestThatFits) {
  const Case patient = shapes::body(shapes::box({0, 0, 0}, {100, 50, 300}));
  const Options options{.voxel_mm = 0, .largest = {25, 12, 70}};
  const Image image = voxelize(patient, options, {});
  const std::size_t limit = std::size_t{25} * 12 * 70;
  EXPECT_LE(image.grid.voxels(), limit);
  EXPECT_GT(image.grid.voxels(), limit * 9 / 10);
  const double finer = image.grid.spacing[0] * 0.999;
  EXPECT_GT(voxelize(patient, {.voxel_mm = finer}, {}).grid.voxels(), limit);
}

TEST(Voxelize, SameBytesForAnyNumberOfThreads) {
  const Case patient = shapes::body(
      shapes::ellipsoid({0, 0, 0}, {20, 15, 30}, 12),
      {shapes::ellipsoid({0, 0, 8}, {8, 6, 14}, 8), shapes::ellipsoid({0, 2, -8}, {8, 6, 9}, 8)});
  std::vector<Image> images;
  for (const int threads : {1, 2, 4}) {
    tbb::task_arena arena(threads);
    arena.execute([&] { images.push_back(voxelize(patient, {.voxel_mm = 0.5}, {})); });
  }
  EXPECT_EQ(images[0].bytes, images[1].bytes);
  EXPECT_EQ(images[0].bytes, images[2].bytes);
}

ErrorKind refusal(const Case& patient, const Options& options, const Context& context, std::string& line) {
  try {
    voxelize(patient, options, context);
  } catch (const Error& e) {
    line = e.what();
    return e.kind();
  }
  ADD_FAILURE() << "nothing was thrown";
  return ErrorKind::internal;
}

// A tube open at both ends, as a CT that cuts off trunk and legs has it, and a ball with a wide hole.
TEST(Voxelize, ASkinThatWouldBeHollowIsRefusedWithWhatClosesIt) {
  const auto open_ball = [](Eigen::Index drop) {
    SurfaceMesh ball = shapes::ellipsoid({0, 0, 0}, {10, 10, 10}, 16);
    ball.F.conservativeResize(ball.F.rows() - drop, 3);
    return ball;
  };
  SurfaceMesh tube = shapes::ellipsoid({0, 0, 0}, {10, 10, 30}, 16);
  std::vector<Eigen::RowVector3i> kept;
  for (Eigen::Index f = 0; f < tube.F.rows(); ++f) {
    bool within = true;
    for (Eigen::Index c = 0; c < 3; ++c) within = within && std::abs(tube.V(tube.F(f, c), 2)) < 20;
    if (within) kept.emplace_back(tube.F.row(f));
  }
  tube.F.resize(static_cast<Eigen::Index>(kept.size()), 3);
  for (std::size_t f = 0; f < kept.size(); ++f) tube.F.row(static_cast<Eigen::Index>(f)) = kept[f];
  for (const SurfaceMesh& skin : {open_ball(64), tube}) {
    std::string line;
    EXPECT_EQ(refusal(shapes::body(skin), {.voxel_mm = 1}, {}, line), ErrorKind::data);
    EXPECT_NE(line.find("skin: the surface is open: "), std::string::npos) << line;
    EXPECT_NE(line.find("ml inside run out through its "), std::string::npos) << line;
    EXPECT_NE(line.find("close it: ecorche repair --holes "), std::string::npos) << line;
  }
}

TEST(Voxelize, ASkinWithoutAnInsideIsRefused) {
  SurfaceMesh sheet;
  sheet.V.resize(4, 3);
  sheet.V << 0, 0, 0, 100, 0, 0, 100, 100, 0, 0, 100, 0;
  sheet.F.resize(2, 3);
  sheet.F << 0, 1, 2, 0, 2, 3;
  SurfaceMesh both_sides = sheet;
  both_sides.F.conservativeResize(4, 3);
  both_sides.F.bottomRows(2) << 2, 1, 0, 3, 2, 0;
  for (const SurfaceMesh& skin : {sheet, both_sides}) {
    std::string line;
    EXPECT_EQ(refusal(shapes::body(skin), {.voxel_mm = 2}, {}, line), ErrorKind::data);
    EXPECT_NE(line.find("skin: encloses no volume"), std::string::npos) << line;
  }
}

TEST(Voxelize, Refusals) {
  const Case patient = shapes::body(shapes::box({0, 0, 0}, {10, 10, 10}));
  std::string line;
  EXPECT_EQ(refusal(patient, {.voxel_mm = 0.001}, {}, line), ErrorKind::config);
  EXPECT_NE(line.find("coarser voxels"), std::string::npos) << line;
  EXPECT_EQ(refusal(patient, {.voxel_mm = -1}, {}, line), ErrorKind::config);
  EXPECT_NE(line.find("give a positive length, or 0 for the finest that fits"), std::string::npos) << line;
  EXPECT_EQ(refusal(shapes::body({}), {}, {}, line), ErrorKind::data);
  EXPECT_NE(line.find("skin has no triangle"), std::string::npos) << line;
  Case broken = patient;
  broken.skin.V(3, 1) = std::nan("");
  EXPECT_EQ(refusal(broken, {}, {}, line), ErrorKind::data);
  std::stop_source stop;
  stop.request_stop();
  Context context;
  context.stop = stop.get_token();
  EXPECT_EQ(refusal(patient, {.voxel_mm = 1}, context, line), ErrorKind::interrupted);
}

}  // namespace
}  // namespace ecorche::voxel
