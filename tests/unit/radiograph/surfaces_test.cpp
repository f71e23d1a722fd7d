// SPDX-License-Identifier: Apache-2.0
// Line integrals through closed surfaces, against spheres and boxes and against triangles met one by one.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "tests/unit/radiograph/shapes.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

using test::kUsual;

// An icosahedron whose triangles are parted so many times.
SurfaceMesh sphere(const Vector3d& centre, double radius, int times) {
  const double g = (1 + std::sqrt(5)) / 2;
  std::vector<Vector3d> points{{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                               {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  std::vector<std::array<int, 3>> faces{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                        {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                        {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                        {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int t = 0; t < times; ++t) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [found, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<int>(points.size()));
      if (fresh)
        points.push_back(points[static_cast<std::size_t>(a)].normalized() +
                         points[static_cast<std::size_t>(b)].normalized());
      return found->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    faces = finer;
  }
  SurfaceMesh out;
  out.V.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t v = 0; v < points.size(); ++v)
    out.V.row(static_cast<Eigen::Index>(v)) = (centre + radius * points[v].normalized()).transpose();
  out.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::size_t c = 0; c < 3; ++c)
      out.F(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(c)) = faces[f][c];
  }
  return out;
}

// Bodies that no stage made: the tracer looks at tissues alone.
struct Body {
  Model model;
  PosedBody posed;

  void add(const std::string& name, Group group, const SurfaceMesh& mesh) {
    Tissue tissue;
    tissue.name = name;
    tissue.group = group;
    tissue.V = mesh.V.cast<float>();
    tissue.F = mesh.F;
    posed.tissues.emplace_back(tissue.V.data(), tissue.V.data() + tissue.V.size());
    model.tissues.push_back(std::move(tissue));
  }
  std::vector<float> pictured(const XRaySetup& setup, const Context& context = {}) const {
    return line_integrals(model, posed, kUsual, setup, context);
  }
};

double soft() {
  return kUsual.of_hu(nominal_hu(Group::skin, ""));
}
double bone() {
  return kUsual.of_hu(nominal_hu(Group::bone, ""));
}

// From front and back, seen from either side.
std::vector<XRaySetup> setups(int pixels) {
  XRaySetup front = test::from_front(200, pixels);
  XRaySetup mirrored = front;
  mirrored.detector.right *= -1;
  XRaySetup aslant = front;
  const Eigen::AngleAxisd turn(0.3, Vector3d(1, 2, -1).normalized());
  aslant.detector.right = turn * aslant.detector.right;
  aslant.detector.down = turn * aslant.detector.down;
  return {front, mirrored, aslant};
}

TEST(RadiographOfSurfaces, IsTheChordOfASphereAtEveryPixel) {
  constexpr double radius = 60;
  const Vector3d centre(4, -9, 13);
  Body body;
  body.add("skin", Group::skin, sphere(centre, radius, 5));
  for (const XRaySetup& setup : setups(150)) {
    const std::vector<float> integrals = body.pictured(setup);
    std::size_t i = 0, inside = 0;
    for (int row = 0; row < 150; ++row) {
      for (int column = 0; column < 150; ++column, ++i) {
        const Vector3d pixel = setup.detector.point(column, row);
        const double known = test::chord(setup.source, pixel, centre, radius);
        const double off = (centre - setup.source).cross((pixel - setup.source).normalized()).norm();
        // Edges are 2 mm long, flat triangles 0.02 mm below the sphere; at its rim a chord grows to 3 mm.
        const double bound = std::abs(off - radius) > 0.5 ? 0.4 : 12;
        ASSERT_NEAR(integrals[i] / soft(), known, bound) << off;
        inside += known > 0 ? 1 : 0;
      }
    }
    EXPECT_GT(inside, 4000U);
  }
}

TEST(RadiographOfSurfaces, AddsWhatATissueAttenuatesBeyondSoftTissue) {
  Body body;
  body.add("skin", Group::skin, sphere({0, 0, 0}, 60, 5));
  body.add("femur", Group::bone, sphere({0, 0, 0}, 20, 5));
  body.add("lung_left", Group::organ, sphere({0, 30, 0}, 5, 4));
  body.add("muscle", Group::other, sphere({20, 0, 0}, 10, 4));  // as soft as what it lies in
  XRaySetup setup = test::from_front(1, 1);
  const double lung = kUsual.of_hu(-750);
  EXPECT_NEAR(body.pictured(setup)[0], 70 * soft() + 40 * bone() + 10 * lung, 0.02);
  // What lies behind the detector is not seen: here that is half of all.
  setup.detector.centre = {0, 0, 0};
  EXPECT_NEAR(body.pictured(setup)[0], 40 * soft() + 20 * bone(), 0.02);
}

TEST(RadiographOfSurfaces, LosesNoRayBetweenTriangles) {
  // A cube, every corner of which lies on the centre of a pixel's ray, and every face of which is two
  // triangles.
  SurfaceMesh cube;
  cube.V.resize(8, 3);
  for (int v = 0; v < 8; ++v) cube.V.row(v) << (v & 1 ? 32 : -32), (v & 2 ? 32 : -32), (v & 4 ? 32 : -32);
  cube.F.resize(12, 3);
  cube.F << 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7,
      4, 7, 6;
  Body body;
  body.add("skin", Group::skin, cube);
  XRaySetup setup = test::from_front(64, 64, 1e5, 100);  // nearly parallel: a ray a millimetre
  setup.detector.centre += Vector3d(0.5, 0, 0.5);
  const std::vector<float> integrals = body.pictured(setup);
  int whole = 0;
  for (std::size_t i = 0; i < integrals.size(); ++i) {
    const double mm = integrals[i] / soft();
    ASSERT_TRUE(mm < 0.1 || std::abs(mm - 64) < 0.1) << i << ": " << mm;
    whole += mm > 32 ? 1 : 0;
  }
  EXPECT_GE(whole, 62 * 62);
}

TEST(RadiographOfSurfaces, LeavesOutWhatIsOpen) {
  Body body;
  body.add("skin", Group::skin, sphere({0, 0, 0}, 60, 3));
  SurfaceMesh open = sphere({0, 0, 0}, 20, 3);
  open.F.conservativeResize(open.F.rows() - 1, 3);
  body.add("rib", Group::bone, open);
  const XRaySetup setup = test::from_front(1, 1);
  std::vector<std::string> told;
  Context context;
  context.log = [&](LogLevel, std::string_view line) { told.emplace_back(line); };
  EXPECT_NEAR(body.pictured(setup, context)[0], 120 * soft(), 0.02);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_NE(told[0].find("'rib' is not closed"), std::string::npos);
  body.model.tissues[0].F.conservativeResize(body.model.tissues[0].F.rows() - 1, 3);
  EXPECT_THROW(body.pictured(setup), Error);
}

TEST(RadiographOfSurfaces, RefusesASourceInTheBody) {
  Body body;
  body.add("skin", Group::skin, sphere({0, 0, 0}, 60, 2));
  XRaySetup setup = test::from_front(100, 16);
  setup.source = {0, 0, 0};
  try {
    body.pictured(setup);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "source: 'skin' reaches beside or behind it (move the source away from the body)");
  }
}

}  // namespace
}  // namespace ecorche::runtime
