// SPDX-License-Identifier: Apache-2.0
// A neck made of bodies, arches, facets and a dens, whose vertebrae are known: what of it comes apart, and
// what does not.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include <Eigen/Geometry>
#include "preprocess/scan/part_vertebrae.hpp"

namespace ecorche::scan {
namespace {

constexpr double kFlesh = 50, kHard = 700, kThreshold = 226, kSkin = -300;
constexpr double kPitch = 17, kTop = 120;  // mm: from disc to disc; of the axis' lower end

struct Made {
  Image ct;
  std::vector<std::uint8_t> truth, neck, other;  // truth: which vertebra
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
};

struct Kind {
  int last = 6;      // the lowest vertebra
  double tilt = 0;   // of all, about the left-right axis, radians
  double gap = 4;    // mm, of discs
  int fused = 0;     // the disc below this vertebra is bone
  double joint = 2;  // mm, beside the dens; 0: atlas and axis are one there
  bool axis = true;  // else what lies above C3 is cut off
  double voxel = 1;  // mm
};

// Which vertebra is at a point of the neck's own frame (x left, y back, z up), 0: none.
int vertebra_at(const Kind& kind, double x, double y, double z) {
  const auto within = [](double v, double low, double high) { return v >= low && v <= high; };
  const double a = std::abs(x);
  for (int c = 3; c <= kind.last; ++c) {
    const double top = kTop - kind.gap - kPitch * (c - 3), low = top - (kPitch - kind.gap);
    const double deep = c == kind.fused ? low - kind.gap : low;
    if (within(z, deep, top) && a < 9 && within(y, -8, 8)) return c;                    // body
    if (within(z, low + 2, top - 3) && within(a, 9, 14) && within(y, 2, 16)) return c;  // pedicles
    // Facets stand one on the other, a millimetre apart, and slope.
    const double slope = z + 0.5 * (y - 16);
    if (within(slope, low - 2.5, top + 0.5) && within(a, 13, 21) && within(y, 11, 20)) return c;
    if (within(z, low, top - 6) && a < 14 && within(y, 24, 28)) return c;  // lamina
    if (within(z, low + 1, top - 7) && within(a, 12, 16) && within(y, 18, 26)) return c;
    if (within(z, low - 4, low + 2) && a < 3 && within(y, 27, 44)) return c;  // spinous process
  }
  if (!kind.axis) return 0;
  const double joint = kTop + 20 - 0.4 * (a - 14);
  if (within(z, kTop, kTop + 19) && a < 9 && within(y, -8, 8)) return 2;
  if (within(z, kTop, kTop + 36) && a < 4.5 && within(y, -4, 5)) return 2;
  if (within(a, 8, 20) && within(y, -6, 9) && within(z, kTop + 6, joint - kind.joint / 2)) return 2;
  if (within(z + 0.5 * (y - 16), kTop - 2.5, kTop + 8) && within(a, 13, 21) && within(y, 9, 20)) return 2;
  if (within(z, kTop + 2, kTop + 14) && a < 16 && within(y, 22, 40) && (a < 5 || y < 28)) return 2;
  if (within(z, kTop + 4, kTop + 12) && within(a, 13, 17) && within(y, 18, 24)) return 2;
  if (within(a, 8, 20) && within(y, -8, 9) && within(z, joint + kind.joint / 2, joint + 13)) return 1;
  const double ring = std::hypot(x / 20, (y - 8) / 20);
  if (within(z, kTop + 24, kTop + 33) && within(ring, 0.8, 1.05)) return 1;
  return 0;
}

Made make(const Kind& kind) {
  Made out;
  ImageGrid grid;
  grid.spacing = {kind.voxel, kind.voxel, kind.voxel};
  const double low[3] = {-30, -25, 15}, high[3] = {30, 55, 175};
  for (std::size_t a = 0; a < 3; ++a) grid.size[a] = static_cast<int>((high[a] - low[a]) / kind.voxel);
  grid.origin = {low[0], low[1], low[2]};
  out.axes = Eigen::AngleAxisd(kind.tilt, Eigen::Vector3d::UnitX()).toRotationMatrix();
  out.ct = Image(grid, ScalarType::i16);
  const auto hu = out.ct.scalars<std::int16_t>();
  out.truth.assign(grid.voxels(), 0);
  out.neck = out.other = out.truth;
  const Eigen::Vector3d middle(0, 10, 90);
  std::size_t at = 0;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i, ++at) {
        // Eight samples a voxel: borders are grey, as in a scanner.
        std::map<int, int> count;
        for (int s = 0; s < 8; ++s) {
          const auto p = grid.point(i + ((s & 1) != 0 ? 0.25 : -0.25), j + ((s & 2) != 0 ? 0.25 : -0.25),
                                    k + ((s & 4) != 0 ? 0.25 : -0.25));
          const Eigen::Vector3d q =
              out.axes.transpose() * (Eigen::Vector3d(p[0], p[1], p[2]) - middle) + middle;
          ++count[vertebra_at(kind, q[0], q[1], q[2])];
        }
        const int flesh = count[0];
        hu[at] = static_cast<std::int16_t>((flesh * kFlesh + (8 - flesh) * kHard) / 8);
        count.erase(0);
        int most = 0;
        for (const auto& [vertebra, n] : count) {
          if (n <= most) continue;
          most = n;
          out.truth[at] = static_cast<std::uint8_t>(vertebra);
        }
        out.neck[at] = static_cast<double>(hu[at]) > kThreshold ? 1 : 0;
      }
    }
  }
  return out;
}

PartedNeck parted(const Made& made) {
  return part_neck(made.ct, made.neck, made.other, made.axes, kThreshold, kSkin, Context{});
}

double dice(const Made& made, const PartedNeck& found, std::size_t piece) {
  double own = 0, theirs = 0, both = 0;
  for (std::size_t v = 0; v < made.neck.size(); ++v) {
    if (made.neck[v] == 0) continue;
    const bool here = found.of[v] == piece + 1;
    const bool there =
        made.truth[v] >= found.pieces[piece].first && made.truth[v] <= found.pieces[piece].last;
    own += here ? 1 : 0;
    theirs += there ? 1 : 0;
    both += here && there ? 1 : 0;
  }
  return 2 * both / std::max(1.0, own + theirs);
}

void expect_each_alone(const Made& made, int last, double least) {
  const PartedNeck found = parted(made);
  ASSERT_EQ(found.pieces.size(), static_cast<std::size_t>(last)) << found.why;
  for (std::size_t p = 0; p < found.pieces.size(); ++p) {
    EXPECT_EQ(found.pieces[p].first, static_cast<int>(p) + 1);
    EXPECT_EQ(found.pieces[p].last, static_cast<int>(p) + 1);
    EXPECT_GT(found.pieces[p].contrast, p + 1 < found.pieces.size() ? 0.35 : 0.2);
    EXPECT_GT(dice(made, found, p), least) << "C" << p + 1;
  }
}

TEST(PartNeck, EachVertebraIsItsOwn) {
  expect_each_alone(make({}), 6, 0.95);
}

TEST(PartNeck, ABentNeckToo) {
  expect_each_alone(make({.tilt = 0.3}), 6, 0.93);
}

TEST(PartNeck, VoxelsOfTwoMillimetresAreFineEnough) {
  expect_each_alone(make({.joint = 3, .voxel = 2}), 6, 0.85);
}

TEST(PartNeck, WhatGrewTogetherIsToldAsOne) {
  const Made made = make({.fused = 4});
  const PartedNeck found = parted(made);
  ASSERT_EQ(found.pieces.size(), 5u) << found.why;
  EXPECT_EQ(found.pieces[3].first, 4);
  EXPECT_EQ(found.pieces[3].last, 5);
  EXPECT_EQ(found.pieces[4].first, 6);
  for (std::size_t p = 0; p < found.pieces.size(); ++p) EXPECT_GT(dice(made, found, p), 0.93) << p;
}

TEST(PartNeck, AtlasAndAxisThatTouchAreToldAsOne) {
  const Made made = make({.joint = 0});
  const PartedNeck found = parted(made);
  ASSERT_EQ(found.pieces.size(), 5u) << found.why;
  EXPECT_EQ(found.pieces[0].first, 1);
  EXPECT_EQ(found.pieces[0].last, 2);
  EXPECT_EQ(found.pieces[1].first, 3);
  EXPECT_GT(dice(made, found, 0), 0.95);
}

TEST(PartNeck, WithoutTheAxisNothingIsCounted) {
  const PartedNeck found = parted(make({.axis = false}));
  EXPECT_TRUE(found.pieces.empty());
  EXPECT_NE(found.why.find("no axis with its dens is in view"), std::string::npos) << found.why;
}

TEST(PartNeck, WithoutDiscsItIsOne) {
  const PartedNeck found = parted(make({.gap = 0, .axis = false}));
  EXPECT_TRUE(found.pieces.empty());
  EXPECT_NE(found.why.find("no disc is darker"), std::string::npos) << found.why;
}

TEST(PartNeck, NoNeckIsNone) {
  Made made = make({});
  std::fill(made.neck.begin(), made.neck.end(), std::uint8_t{0});
  EXPECT_EQ(parted(made).why, "what was found of it is no neck");
}

}  // namespace
}  // namespace ecorche::scan
