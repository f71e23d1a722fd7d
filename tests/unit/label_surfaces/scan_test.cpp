// SPDX-License-Identifier: Apache-2.0
// Pieces of labels, their sides, and the patient in a CT.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "preprocess/scan/ct_body.hpp"
#include "preprocess/scan/pieces.hpp"
#include "preprocess/scan/sides.hpp"

namespace ecorche::scan {
namespace {

// The slow and obvious twin: floods from each voxel through faces and edges.
std::vector<int> flooded(const Image& labels, const std::vector<std::uint8_t>& wanted) {
  const auto voxels = labels.scalars<std::uint16_t>();
  const auto& n = labels.grid.size;
  std::vector<int> of(voxels.size(), -1);
  int next = 0;
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i) {
        const std::size_t start = labels.grid.offset(i, j, k);
        const std::uint16_t id = voxels[start];
        if (of[start] >= 0 || id >= wanted.size() || wanted[id] == 0) continue;
        std::vector<std::array<int, 3>> work{{i, j, k}};
        of[start] = next;
        while (!work.empty()) {
          const auto at = work.back();
          work.pop_back();
          for (int d = 0; d < 27; ++d) {
            const std::array<int, 3> step{d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1};
            if (std::abs(step[0]) + std::abs(step[1]) + std::abs(step[2]) > 2) continue;
            const std::array<int, 3> to{at[0] + step[0], at[1] + step[1], at[2] + step[2]};
            bool in = true;
            for (std::size_t a = 0; a < 3; ++a) in = in && to[a] >= 0 && to[a] < n[a];
            if (!in) continue;
            const std::size_t v = labels.grid.offset(to[0], to[1], to[2]);
            if (voxels[v] != id || of[v] >= 0) continue;
            of[v] = next;
            work.push_back(to);
          }
        }
        ++next;
      }
    }
  }
  return of;
}

TEST(Pieces, AreThoseOfAFlood) {
  std::mt19937 random(7);
  for (int round = 0; round < 60; ++round) {
    ImageGrid grid;
    grid.size = {static_cast<std::int32_t>(1 + random() % 9), static_cast<std::int32_t>(1 + random() % 8),
                 static_cast<std::int32_t>(1 + random() % 7)};
    Image labels(grid, ScalarType::u16);
    for (std::uint16_t& v : labels.scalars<std::uint16_t>())
      v = static_cast<std::uint16_t>(random() % (2 + round % 4));
    const std::vector<std::uint8_t> wanted{0, 1, 1};
    const std::vector<int> slow = flooded(labels, wanted);
    const Pieces fast = find_pieces(labels, wanted, Context{});
    std::vector<int> of(slow.size(), -1);
    std::vector<std::size_t> voxels(fast.pieces.size(), 0);
    for (const scan::Run& run : fast.runs) {
      for (int i = run.begin; i < run.end; ++i)
        of[grid.offset(i, run.j, run.k)] = static_cast<int>(run.piece);
      voxels[run.piece] += static_cast<std::size_t>(run.end - run.begin);
    }
    EXPECT_EQ(of, slow);
    for (std::size_t p = 0; p < voxels.size(); ++p) EXPECT_EQ(fast.pieces[p].voxels, voxels[p]);
  }
}

TEST(Pieces, KnowTheirCentresAndBorders) {
  ImageGrid grid;
  grid.size = {5, 4, 3};
  grid.spacing = {2, 1, 1};
  grid.origin = {10, 0, 0};
  Image labels(grid, ScalarType::u16);
  const auto voxels = labels.scalars<std::uint16_t>();
  for (int i = 2; i < 5; ++i) voxels[grid.offset(i, 1, 0)] = 1;
  const Pieces found = find_pieces(labels, {0, 1}, Context{});
  ASSERT_EQ(found.pieces.size(), 1u);
  EXPECT_EQ(found.pieces[0].centre, (std::array<double, 3>{16, 1, 0}));
  EXPECT_EQ(found.pieces[0].on_border, (std::array<std::size_t, 6>{0, 1, 0, 0, 3, 0}));
}

const Neighbours kLegs{{"thigh", "pelvis"}, {"shank", "thigh"}, {"foot", "shank"}};

// A rod of points from `a` to `b`.
SidedPiece rod(const std::string& structure, const std::string& segment, Side side, std::array<double, 3> a,
               std::array<double, 3> b) {
  SidedPiece piece{structure, segment, side, 1000, {}, {}};
  for (int i = 0; i <= 20; ++i) {
    const double t = i / 20.0;
    piece.points.push_back({a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])});
  }
  piece.centre = piece.points[10];
  return piece;
}

TEST(Sides, CrossedLegsKeepTheirOwn) {
  // The left shank and foot lie on the right of the body, and the other way round.
  const std::vector<SidedPiece> pieces{rod("femur", "thigh", Side::left, {80, 0, 800}, {60, 0, 420}),
                                       rod("femur", "thigh", Side::right, {-80, 0, 800}, {-60, 0, 420}),
                                       rod("tarsal", "foot", Side::both, {-120, 0, 30}, {-120, -100, 30}),
                                       rod("tibia", "shank", Side::both, {55, -20, 400}, {-120, -40, 50}),
                                       rod("tibia", "shank", Side::both, {-55, 20, 400}, {120, 40, 50}),
                                       rod("tarsal", "foot", Side::both, {120, 0, 30}, {120, -100, 30})};
  const auto found = find_sides(pieces, kLegs, Side::both);
  EXPECT_EQ(found[2].side, Side::left);
  EXPECT_EQ(found[3].side, Side::left);
  EXPECT_EQ(found[4].side, Side::right);
  EXPECT_EQ(found[5].side, Side::right);
  EXPECT_NE(found[3].why.find("nearest to the femur"), std::string::npos);
  for (const auto& f : found) EXPECT_GT(f.confidence, 0.6);
}

TEST(Sides, WithoutAnySideTheMiddleTells) {
  const std::vector<SidedPiece> spine{rod("vertebra_l3", "", Side::both, {2, 0, 900}, {2, 0, 960}),
                                      rod("femur", "thigh", Side::both, {80, 0, 800}, {60, 0, 420}),
                                      rod("tibia", "shank", Side::both, {58, 0, 400}, {60, 0, 50}),
                                      rod("femur", "thigh", Side::both, {-80, 0, 800}, {-60, 0, 420})};
  const auto found = find_sides(spine, kLegs, Side::both);
  EXPECT_EQ(found[1].side, Side::left);
  EXPECT_EQ(found[2].side, Side::left);
  EXPECT_EQ(found[3].side, Side::right);
  // Pairs of like pieces have a middle, too.
  const std::vector<SidedPiece> pair(spine.begin() + 1, spine.end());
  EXPECT_EQ(find_sides(pair, kLegs, Side::both)[2].side, Side::right);
}

TEST(Sides, OneLimbAloneIsToldByItsFibulaOrByTheUser) {
  const std::vector<SidedPiece> knee{rod("femur", "thigh", Side::both, {500, 0, 500}, {500, 0, 420}),
                                     rod("tibia", "shank", Side::both, {500, 0, 410}, {500, 0, 300}),
                                     rod("fibula", "shank", Side::both, {460, 10, 390}, {460, 10, 300})};
  for (const auto& f : find_sides(knee, kLegs, Side::both)) EXPECT_EQ(f.side, Side::right);
  for (const auto& f : find_sides(knee, kLegs, Side::left)) EXPECT_EQ(f.side, Side::left);
  const auto femur = find_sides({knee[0]}, kLegs, Side::both);
  EXPECT_EQ(femur[0].side, Side::both);
  EXPECT_EQ(femur[0].why, "nothing tells left from right here");
}

TEST(Sides, WhatLiesOnBothSidesIsRefused) {
  const auto found = find_sides({rod("vertebra_l3", "", Side::both, {0, 0, 900}, {0, 0, 960}),
                                 rod("tarsal", "foot", Side::both, {-90, 0, 30}, {90, 0, 30})},
                                kLegs, Side::both);
  EXPECT_EQ(found[1].side, Side::both);
  EXPECT_EQ(found[1].why, "it lies on both sides of the middle");
}

TEST(CtBody, TheTableIsTakenOffAndHollowsAreFilled) {
  ImageGrid grid;
  grid.size = {80, 60, 12};
  grid.spacing = {2, 2, 4};
  Image ct(grid, ScalarType::i16);
  const auto hu = ct.scalars<std::int16_t>();
  std::vector<std::uint8_t> truth(grid.voxels(), 0), known(grid.voxels(), 0);
  for (int k = 0; k < 12; ++k) {
    for (int j = 0; j < 60; ++j) {
      for (int i = 0; i < 80; ++i) {
        const std::size_t at = grid.offset(i, j, k);
        const double r = std::hypot((i - 40) / 30.0, (j - 25) / 20.0);
        hu[at] = -1000;
        if (r <= 1) {
          truth[at] = 1;
          hu[at] = r < 0.5 ? -800 : 40;   // lungs within
        } else if (j >= 46 && j <= 47) {  // a table a voxel away from the back
          hu[at] = 100;
        }
        if (std::abs(i - 40) <= 1 && std::abs(j - 40) <= 1) known[at] = 1;
      }
    }
  }
  for (const auto& labelled : {std::vector<std::uint8_t>(), known}) {
    const CtBody body = find_body(ct, -300, 6, labelled, Context{});
    std::size_t wrong = 0;
    for (std::size_t v = 0; v < truth.size(); ++v) wrong += body.inside[v] != truth[v] ? 1 : 0;
    EXPECT_LT(wrong, truth.size() / 200);
    EXPECT_NEAR(body.taken_off_ml, 80 * 2 * 12 * 16e-3, 5);
  }
}

}  // namespace
}  // namespace ecorche::scan
