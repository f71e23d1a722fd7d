// SPDX-License-Identifier: Apache-2.0
// Stored weights of whole bodies: rows and bounds of each, and how far the same 1000 points of one body
// differ between its meshes (Sujar18 3.3: independent of the mesh's topology and resolution). Reads
// ECORCHE_MODELS (paths of models of one body, separated by colons) or ECORCHE_MODEL.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <ecorche/model_file/model_file.hpp>

namespace ecorche {
namespace {

constexpr std::size_t kPoints = 1000;

/// Bounds of the differences, twice what was measured on the small phantom by three meshers at 77 000 to 116
/// 000 tets (mean 0.023, 95 % 0.11). Below about 70 000 tets a whole body no longer is the same problem: at
/// 58 000 CGAL keeps 408 of the 2445 nodes in ribs and sternum, and weights of the trunk change (mean 0.076,
/// 95 % 0.34).
struct Bounds {
  double mean, p95;
};
constexpr std::size_t kCoarseTets = 70'000;
constexpr Bounds kFine{0.045, 0.22}, kCoarse{0.15, 0.7};

std::vector<std::string> model_paths() {
  const char* listed = std::getenv("ECORCHE_MODELS");
  if (listed == nullptr) listed = std::getenv("ECORCHE_MODEL");
  std::vector<std::string> paths;
  std::istringstream in(listed == nullptr ? "" : listed);
  for (std::string path; std::getline(in, path, ':');) paths.push_back(path);
  return paths;
}

/// Barycentrics of `p` in tet `t`.
Eigen::Vector4d barycentric(const Model& model, Eigen::Index t, const Eigen::Vector3d& p) {
  Eigen::Matrix4d corners;
  for (Eigen::Index k = 0; k < 4; ++k) {
    corners.col(k) << model.nodes.row(model.tets(t, k)).cast<double>().transpose(), 1;
  }
  return corners.partialPivLu().solve(Eigen::Vector4d(p.x(), p.y(), p.z(), 1));
}

/// Points spread evenly over the body's volume by a fixed seed.
std::vector<Eigen::Vector3d> draw_points(const Model& model) {
  std::vector<double> sums(model.tet_count());
  double volume = 0;
  for (std::size_t t = 0; t < sums.size(); ++t) {
    const auto p = [&](Eigen::Index k) {
      return model.nodes.row(model.tets(static_cast<Eigen::Index>(t), k));
    };
    sums[t] = volume += tet_det(p(0), p(1), p(2), p(3));
  }
  std::mt19937 random(33);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Eigen::Vector3d> points;
  while (points.size() < kPoints) {
    const auto at = std::lower_bound(sums.begin(), sums.end(), unit(random) * volume);
    const auto t = static_cast<Eigen::Index>(at - sums.begin());
    Eigen::Vector4d w;
    for (Eigen::Index k = 0; k < 4; ++k) w(k) = -std::log(1 - unit(random));
    w /= w.sum();
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    for (Eigen::Index k = 0; k < 4; ++k)
      p += w(k) * model.nodes.row(model.tets(t, k)).cast<double>().transpose();
    points.push_back(p);
  }
  return points;
}

/// Weights at each point, a row per point and a column per segment; a row of zeros where the point is in no
/// tet. Goes through the tets once, against the points sorted along z.
Eigen::MatrixXd weights_at(const Model& model, const std::vector<Eigen::Vector3d>& points) {
  std::vector<std::pair<double, Eigen::Index>> by_z;
  for (std::size_t i = 0; i < points.size(); ++i)
    by_z.emplace_back(points[i].z(), static_cast<Eigen::Index>(i));
  std::sort(by_z.begin(), by_z.end());
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(points.size()),
                                                 static_cast<Eigen::Index>(model.segment_count()));
  std::vector<std::uint8_t> found(points.size(), 0);
  for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
    Eigen::AlignedBox3d box;
    for (Eigen::Index k = 0; k < 4; ++k)
      box.extend(model.nodes.row(model.tets(t, k)).cast<double>().transpose());
    auto at = std::lower_bound(by_z.begin(), by_z.end(), std::pair<double, Eigen::Index>(box.min().z(), -1));
    for (; at != by_z.end() && at->first <= box.max().z(); ++at) {
      const Eigen::Vector3d& p = points[static_cast<std::size_t>(at->second)];
      if (found[static_cast<std::size_t>(at->second)] || !box.contains(p)) continue;
      const Eigen::Vector4d b = barycentric(model, t, p);
      if (b.minCoeff() < -1e-9) continue;
      found[static_cast<std::size_t>(at->second)] = 1;
      for (Eigen::Index k = 0; k < 4; ++k) {
        const auto n = static_cast<std::size_t>(model.tets(t, k));
        for (auto e = model.weights.offsets[n]; e < model.weights.offsets[n + 1]; ++e) {
          result(at->second, model.weights.segment[e]) += b(k) * static_cast<double>(model.weights.weight[e]);
        }
      }
    }
  }
  return result;
}

TEST(StoredWeights, RowsAndBoundsOfEveryModel) {
  const auto paths = model_paths();
  ASSERT_FALSE(paths.empty()) << "set ECORCHE_MODELS or ECORCHE_MODEL";
  std::printf("  solved in [min, 1 + max]          rows within  repaired  largest change  positive  model\n");
  for (const std::string& path : paths) {
    const Model model = model_file::read(path, {});
    const Weights& w = model.weights;
    double worst = 0;
    for (std::size_t n = 0; n < model.node_count(); ++n) {
      ASSERT_LT(w.offsets[n], w.offsets[n + 1]) << "node " << n;
      double sum = 0;
      for (auto e = w.offsets[n]; e < w.offsets[n + 1]; ++e) {
        ASSERT_GE(static_cast<double>(w.weight[e]), 1e-6);
        ASSERT_LE(w.weight[e], 1.0F);
        ASSERT_LT(w.segment[e], model.segment_count());
        sum += static_cast<double>(w.weight[e]);
      }
      worst = std::max(worst, std::abs(sum - 1));
    }
    const Certificate& c = model.certificate;
    std::printf("  [%10.2e, 1 %+10.2e]      %.1e  %8llu  %14.1e  %7.2f %%  %s\n", c.solved_min_weight,
                c.solved_max_weight - 1, worst, static_cast<unsigned long long>(c.repaired_rows),
                c.repaired_largest_change, 100 * c.positive_offdiagonal_share,
                std::filesystem::path(path).filename().c_str());
    EXPECT_LE(worst, 1e-6);
    EXPECT_LE(c.solved_row_sum_error, 1e-9);
    EXPECT_GE(c.solved_min_weight, -1e-3);
    EXPECT_LE(c.solved_max_weight, 1 + 1e-3);
    EXPECT_LE(c.repaired_largest_change, 1e-2);
  }
}

TEST(StoredWeights, DifferLittleBetweenMeshesOfOneBody) {
  const auto paths = model_paths();
  ASSERT_FALSE(paths.empty()) << "set ECORCHE_MODELS or ECORCHE_MODEL";
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::MatrixXd> weights;
  std::vector<std::string> names;
  std::vector<std::size_t> tets;
  for (const std::string& path : paths) {
    const Model model = model_file::read(path, {});
    if (points.empty()) points = draw_points(model);
    weights.push_back(weights_at(model, points));
    names.push_back(std::filesystem::path(path).stem().string());
    tets.push_back(model.tet_count());
    ASSERT_EQ(weights.back().cols(), weights.front().cols()) << path << " is of another body";
  }
  std::printf("  largest difference of a weight at a point: mean, median, 95 %%, largest; points in both\n");
  for (std::size_t a = 0; a < weights.size(); ++a) {
    for (std::size_t b = a + 1; b < weights.size(); ++b) {
      std::vector<double> difference;
      for (Eigen::Index i = 0; i < weights[a].rows(); ++i) {
        if (weights[a].row(i).sum() == 0 || weights[b].row(i).sum() == 0)
          continue;  // outside one of the meshes
        difference.push_back((weights[a].row(i) - weights[b].row(i)).cwiseAbs().maxCoeff());
      }
      ASSERT_GT(difference.size(), kPoints * 9 / 10);
      std::sort(difference.begin(), difference.end());
      double mean = 0;
      for (const double d : difference) mean += d / static_cast<double>(difference.size());
      const double median = difference[difference.size() / 2], p95 = difference[difference.size() * 95 / 100];
      std::printf("  %.4f  %.4f  %.4f  %.4f  %4zu  %s (%zu tets) - %s (%zu tets)\n", mean, median, p95,
                  difference.back(), difference.size(), names[a].c_str(), tets[a], names[b].c_str(), tets[b]);
      const Bounds bounds = std::min(tets[a], tets[b]) < kCoarseTets ? kCoarse : kFine;
      EXPECT_LT(mean, bounds.mean) << names[a] << " - " << names[b];
      EXPECT_LT(p95, bounds.p95) << names[a] << " - " << names[b];
    }
  }
}

}  // namespace
}  // namespace ecorche
