// SPDX-License-Identifier: Apache-2.0
// Volumes by few vertices against those of the whole surface.
#include <ecorche/runtime/coarse_surface.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include <ecorche/runtime/quality_meter.hpp>
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

constexpr int kAround = 120;

std::span<const float> floats(const PointsF& points) {
  return {points.data(), static_cast<std::size_t>(points.size())};
}

// An ellipsoid with half axes 30, 20 and `height`, of 2 * kAround * (kAround - 1) triangles.
Tissue ellipsoid(float height) {
  Tissue out;
  out.name = "ellipsoid";
  const int rings = kAround - 1;
  out.V.resize(kAround * rings + 2, 3);
  for (int r = 0; r < rings; ++r) {
    const double polar = std::numbers::pi * (r + 1) / (rings + 1);
    for (int a = 0; a < kAround; ++a) {
      const double turn = 2 * std::numbers::pi * a / kAround;
      out.V.row(kAround * r + a) << static_cast<float>(30 * std::sin(polar) * std::cos(turn)),
          static_cast<float>(20 * std::sin(polar) * std::sin(turn)),
          height * static_cast<float>(std::cos(polar));
    }
  }
  const int top = kAround * rings, bottom = top + 1;
  out.V.row(top) << 0, 0, height;
  out.V.row(bottom) << 0, 0, -height;
  std::vector<std::array<int, 3>> F;
  for (int a = 0; a < kAround; ++a) {
    const int next = (a + 1) % kAround, last = kAround * (rings - 1);
    F.push_back({top, a, next});
    F.push_back({bottom, last + next, last + a});
    for (int r = 0; r + 1 < rings; ++r) {
      const int upper = kAround * r, lower = upper + kAround;
      F.push_back({upper + a, lower + a, lower + next});
      F.push_back({upper + a, lower + next, upper + next});
    }
  }
  out.F.resize(static_cast<Eigen::Index>(F.size()), 3);
  for (std::size_t f = 0; f < F.size(); ++f) {
    for (int c = 0; c < 3; ++c) out.F(static_cast<Eigen::Index>(f), c) = F[f][static_cast<std::size_t>(c)];
  }
  return out;
}

// Bent about y through an angle that grows along z, and squeezed on the way: no affine map.
PointsF bent(const PointsF& V) {
  PointsF out = V;
  for (Eigen::Index v = 0; v < V.rows(); ++v) {
    const float angle = 0.02F * V(v, 2), thinner = 1 - 0.002F * V(v, 2);
    const float x = (V(v, 0) + 60) * thinner;
    out.row(v) << x * std::cos(angle), V(v, 1) * thinner, x * std::sin(angle);
  }
  return out;
}

// Every edge as often one way as the other.
bool is_cycle(const CoarseSurface& surface) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> runs;
  for (const auto& t : surface.triangle) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t a = t[c], b = t[(c + 1) % 3];
      runs[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  return std::all_of(runs.begin(), runs.end(), [](const auto& run) { return run.second == 0; });
}

TEST(CoarseSurface, ClusteringKeepsAClosedSurfaceClosed) {
  const Tissue tissue = ellipsoid(50);
  for (const float edge : {4.0F, 11.0F, 25.0F}) {
    const CoarseSurface coarse = cluster_vertices(tissue.V, tissue.F, edge);
    EXPECT_TRUE(is_cycle(coarse));
    EXPECT_GT(coarse.triangle.size(), 10U);
    EXPECT_LT(coarse.triangle.size(), static_cast<std::size_t>(tissue.F.rows()));
    for (const auto& t : coarse.triangle) {
      for (const std::uint32_t corner : t) ASSERT_LT(corner, coarse.vertex.size());
    }
  }
}

TEST(CoarseSurface, VolumesStayNearThoseOfTheWhole) {
  for (const float height : {50.0F, 4.0F}) {
    const Tissue tissue = ellipsoid(height);
    const std::vector<CoarseSurface> coarse = coarsen(tissue.V, tissue.F, 512);
    ASSERT_EQ(coarse.size(), 2U);
    const double whole = 6 * enclosed_volume(floats(tissue.V), tissue.F);
    const PointsF stretched = tissue.V * 1.1F, moved = bent(tissue.V);
    const double change = 6 * enclosed_volume(floats(moved), tissue.F) / whole - 1;
    double shares[2];
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_LT(coarse[i].triangle.size(), static_cast<std::size_t>(tissue.F.rows()) / 4);
      EXPECT_NEAR(coarse[i].rest_6, whole, (i == 0 ? 0.2 : 0.4) * whole);
      EXPECT_NEAR(volume_6(coarse[i], floats(stretched)) / coarse[i].rest_6, 1.331, 1e-4);
      shares[i] = volume_6(coarse[i], floats(moved)) / coarse[i].rest_6 - 1;
    }
    EXPECT_GT(std::abs(change), 0.05);
    EXPECT_NE(shares[0], shares[1]);
    EXPECT_NEAR(shares[0], change, 2 * std::abs(shares[0] - shares[1]) + 1e-3);
    EXPECT_LT(std::abs(shares[0] - change), 0.01);
  }
}

TEST(CoarseSurface, ASheetThatCellsWouldFlattenIsMeasuredWhole) {
  const Tissue tissue = ellipsoid(0.05F);
  const std::vector<CoarseSurface> coarse = coarsen(tissue.V, tissue.F, 64);
  for (const CoarseSurface& surface : coarse) {
    EXPECT_NEAR(surface.rest_6, 6 * enclosed_volume(floats(tissue.V), tissue.F), 0.2 * surface.rest_6);
  }
  EXPECT_EQ(coarse.size(), 1U);
}

TEST(CoarseSurface, ASmallOneIsItself) {
  const Tissue tissue = ellipsoid(50);
  const std::vector<CoarseSurface> coarse =
      coarsen(tissue.V, tissue.F, static_cast<std::size_t>(tissue.F.rows()) / 2);
  ASSERT_EQ(coarse.size(), 1U);
  EXPECT_EQ(coarse[0].triangle.size(), static_cast<std::size_t>(tissue.F.rows()));
  EXPECT_NEAR(coarse[0].rest_6, 6 * enclosed_volume(floats(tissue.V), tissue.F), 1e-5 * coarse[0].rest_6);
}

TEST(QualityMeter, LargeTissuesAreEstimatedWithinTheirError) {
  Model model = test::toy_model();
  Tissue large = ellipsoid(50);
  large.tet.assign(static_cast<std::size_t>(large.V.rows()), 0);
  large.barycentric.setConstant(large.V.rows(), 4, 0.25F);
  model.tissues.push_back(large);
  const auto shared = std::make_shared<const Model>(model);
  const auto row = static_cast<std::uint32_t>(model.tissues.size() - 1);
  PosedBody body = BodyPoser(shared).make_frame();
  const QualityMeter meter(shared);
  const std::vector<std::uint32_t> asked{row};
  EXPECT_EQ(meter.measure(body, asked).tissues[0].share, 0);
  const PointsF moved = bent(large.V);
  body.tissues[row].assign(moved.data(), moved.data() + moved.size());
  const TissueChange quick = meter.measure(body, asked).tissues[0],
                     slow = measure(model, body, asked).tissues[0];
  EXPECT_GT(quick.share_error, 0);
  EXPECT_EQ(slow.share_error, 0);
  EXPECT_NEAR(quick.rest_mm3, slow.rest_mm3, 1e-6 * slow.rest_mm3);
  EXPECT_NEAR(quick.share, slow.share, 2 * quick.share_error + 1e-3);
  EXPECT_NEAR(quick.posed_mm3, quick.rest_mm3 * (1 + quick.share), 1e-6 * quick.rest_mm3);
}

}  // namespace
}  // namespace ecorche::runtime
