// SPDX-License-Identifier: Apache-2.0
#include "app/report/slice.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace ecorche::app::report {
namespace {

constexpr std::int32_t kNoTet = -1;
constexpr double kEdge = 1e-9;  // a pixel centre on a shared face belongs to one of its tets, not to none

struct Sample {
  std::int32_t label = kNoTet, segment = -1;
};

// The weights of a tet's corners, mixed by a point's barycentric coordinates.
class Mixer {
 public:
  explicit Mixer(const Model& model) : model_(model), share_(model.segment_count(), 0) {
    for (std::size_t s = 0; s < share_.size(); ++s) colour_.push_back(colour_of(s));
  }

  /// The mixed colour; `segment` gets the heaviest.
  Colour mix(Eigen::Index tet, const Eigen::Vector4d& barycentric, std::int32_t& segment) {
    std::fill(share_.begin(), share_.end(), 0);
    for (int c = 0; c < 4; ++c) {
      const auto node = static_cast<std::size_t>(model_.tets(tet, c));
      for (auto i = model_.weights.offsets[node]; i < model_.weights.offsets[node + 1]; ++i)
        share_[model_.weights.segment[i]] += barycentric[c] * model_.weights.weight[i];
    }
    std::array<double, 3> sum{};
    for (std::size_t s = 0; s < share_.size(); ++s) {
      for (std::size_t c = 0; c < 3; ++c) sum[c] += share_[s] * colour_[s][c];
    }
    segment = static_cast<std::int32_t>(std::max_element(share_.begin(), share_.end()) - share_.begin());
    Colour out{};
    for (std::size_t c = 0; c < 3; ++c)
      out[c] = static_cast<std::uint8_t>(std::clamp(std::lround(sum[c]), 0L, 255L));
    return out;
  }

 private:
  const Model& model_;
  std::vector<double> share_;
  std::vector<Colour> colour_;
};

}  // namespace

Picture slice(const Model& model, const View& view, const Colour& ground) {
  return slice(model, view, ground, std::vector<double>(static_cast<std::size_t>(view.height), 0));
}

std::vector<double> depth_of_bones(const Model& model, const View& view) {
  const auto rows = static_cast<std::size_t>(view.height);
  std::vector<double> sum(rows, 0), count(rows, 0);
  for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
    if (model.tet_label[static_cast<std::size_t>(t)] == TetMesh::soft) continue;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (int c = 0; c < 4; ++c) centre += model.nodes.row(model.tets(t, c)).transpose().cast<double>() / 4;
    const auto row =
        static_cast<std::size_t>(std::clamp<long>(std::lround(view.y(centre)), 0, view.height - 1));
    sum[row] += (centre - view.centre).dot(view.toward);
    count[row] += 1;
  }
  // Each row takes the mean over its neighbourhood, which grows until there is bone in it.
  std::vector<double> depth(rows, 0);
  for (std::size_t row = 0; row < rows; ++row) {
    double s = 0, n = 0;
    for (std::size_t reach = 8; n == 0 && reach < 2 * rows; reach *= 2) {
      s = n = 0;
      for (std::size_t r = row - std::min(row, reach); r < std::min(rows, row + reach + 1); ++r)
        s += sum[r], n += count[r];
    }
    if (n > 0) depth[row] = s / n;
  }
  return depth;
}

Picture slice(const Model& model, const View& view, const Colour& ground, const std::vector<double>& depths) {
  Picture picture(view.width, view.height, ground);
  std::vector<Sample> sample(picture.pixels.size());
  Mixer mixer(model);
  const auto [nearest, farthest] = std::minmax_element(depths.begin(), depths.end());
  const double plane = view.centre.dot(view.toward), first = plane + *nearest, last = plane + *farthest;
  for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
    Eigen::Matrix<double, 3, 4> corner;
    Eigen::Vector4d depth;
    for (int c = 0; c < 4; ++c) {
      corner.col(c) = model.nodes.row(model.tets(t, c)).transpose().cast<double>();
      depth[c] = corner.col(c).dot(view.toward);
    }
    if (depth.minCoeff() > last || depth.maxCoeff() < first) continue;
    Eigen::Matrix3d edges;
    for (int c = 0; c < 3; ++c) edges.col(c) = corner.col(c + 1) - corner.col(0);
    const Eigen::Matrix3d inverse = edges.inverse();
    Eigen::Vector4d xs, ys;
    for (int c = 0; c < 4; ++c) {
      xs[c] = view.x(corner.col(c));
      ys[c] = view.y(corner.col(c));
    }
    const int left = std::max(0, static_cast<int>(std::ceil(xs.minCoeff())));
    const int right = std::min(view.width - 1, static_cast<int>(std::floor(xs.maxCoeff())));
    const int top = std::max(0, static_cast<int>(std::ceil(ys.minCoeff())));
    const int bottom = std::min(view.height - 1, static_cast<int>(std::floor(ys.maxCoeff())));
    for (int row = top; row <= bottom; ++row) {
      const Eigen::Vector3d before = depths[static_cast<std::size_t>(row)] * view.toward;
      for (int column = left; column <= right; ++column) {
        const Eigen::Vector3d b = inverse * (view.point(column, row) + before - corner.col(0));
        const Eigen::Vector4d barycentric(1 - b.sum(), b[0], b[1], b[2]);
        if (barycentric.minCoeff() < -kEdge) continue;
        Sample& here = sample[static_cast<std::size_t>(row * view.width + column)];
        here.label = model.tet_label[static_cast<std::size_t>(t)];
        const Colour mixture = mixer.mix(t, barycentric, here.segment);
        picture.at(column, row) =
            here.label == TetMesh::soft ? mixture : mixed(mixture, {255, 255, 255}, 0.65);
      }
    }
  }
  // Rims last, where a pixel differs from its right or lower neighbour.
  for (int row = 0; row + 1 < view.height; ++row) {
    for (int column = 0; column + 1 < view.width; ++column) {
      const auto at = static_cast<std::size_t>(row * view.width + column);
      const Sample& here = sample[at];
      for (const std::size_t next : {at + 1, at + static_cast<std::size_t>(view.width)}) {
        const Sample& there = sample[next];
        if (here.label == there.label && here.segment == there.segment) continue;
        const double share = here.label != there.label ? 0.6 : 0.25;
        picture.at(column, row) = mixed(picture.at(column, row), {20, 20, 24}, share);
        break;
      }
    }
  }
  return picture;
}

}  // namespace ecorche::app::report
