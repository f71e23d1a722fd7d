// SPDX-License-Identifier: Apache-2.0
#include "preprocess/correct/compress.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/model_file/packed_field.hpp"

namespace ecorche::correct {
namespace {

using model_file::PackedField;

constexpr int kByte = 127;
constexpr float kMost = kByte << PackedField::most_shift;
constexpr double kLeastSize = 1e-3;  // mm, of a sample
using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

float largest(std::span<const float> mm) {
  float most = 0;
  for (const float value : mm) most = std::max(most, std::abs(value));
  return most;
}

// #samples by 3 * #kept, mm.
Rows rows_of(std::span<const std::vector<float>> fields, const std::vector<std::size_t>& kept) {
  Rows out(static_cast<Eigen::Index>(fields.size()), static_cast<Eigen::Index>(3 * kept.size()));
  for (std::size_t s = 0; s < fields.size(); ++s)
    for (std::size_t k = 0; k < kept.size(); ++k)
      for (std::size_t c = 0; c < 3; ++c)
        out(static_cast<Eigen::Index>(s), static_cast<Eigen::Index>(3 * k + c)) = fields[s][3 * kept[k] + c];
  return out;
}

struct Modes {
  Eigen::MatrixXd mix;     // #samples by #modes: what a sample has of each
  Eigen::MatrixXd fields;  // #modes by 3 * #kept, mm
};

// The weightiest first; of each the largest share is positive. What is missed of a sample counts by the size
// of the sample: deep bends move flesh by centimetres, and would take all modes for themselves.
Modes principal(const Rows& rows, double left_mm, std::size_t most) {
  const Eigen::Index samples = rows.rows();
  const Eigen::VectorXd weight = rows.cast<double>().rowwise().norm().cwiseMax(kLeastSize).cwiseInverse();
  const Eigen::MatrixXd weighted = weight.asDiagonal() * rows.cast<double>();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(weighted * weighted.transpose());
  const Eigen::ArrayXd unweigh = weight.array().square().inverse();
  const Eigen::Index nodes = rows.cols() / 3;
  const double enough = left_mm * left_mm * static_cast<double>(samples) * static_cast<double>(nodes);
  double left = rows.cast<double>().squaredNorm();
  std::vector<Eigen::VectorXd> modes;
  for (Eigen::Index m = samples - 1; m >= 0 && modes.size() < most && (left > enough || modes.empty()); --m) {
    Eigen::VectorXd mode = eigen.eigenvectors().col(m);
    Eigen::Index largest = 0;
    mode.cwiseAbs().maxCoeff(&largest);
    if (mode[largest] < 0) mode = -mode;
    left -= (unweigh * mode.array().square()).sum() * eigen.eigenvalues()[m];
    modes.push_back(std::move(mode));
  }
  Modes out{Eigen::MatrixXd(samples, static_cast<Eigen::Index>(modes.size())), {}};
  for (std::size_t m = 0; m < modes.size(); ++m) out.mix.col(static_cast<Eigen::Index>(m)) = modes[m];
  out.fields = out.mix.transpose() * weighted;
  out.mix = weight.cwiseInverse().asDiagonal() * out.mix;
  return out;
}

}  // namespace

JointCorrection compress(std::int32_t joint, bool hinge, const JointCorrection::Turns& turn,
                         std::span<const std::vector<float>> fields, const std::vector<std::uint32_t>& node,
                         const CompressOptions& options) {
  JointCorrection out;
  out.joint = joint;
  out.turn = turn;
  std::vector<std::size_t> kept;
  for (std::size_t n = 0; n < node.size(); ++n) {
    const bool counts = std::any_of(fields.begin(), fields.end(), [&](const std::vector<float>& field) {
      return static_cast<double>(Eigen::Map<const Eigen::Vector3f>(&field[3 * n]).norm()) > options.least_mm;
    });
    if (!counts) continue;
    kept.push_back(n);
    out.node.push_back(node[n]);
  }
  if (kept.empty()) return out;
  const Rows rows = rows_of(fields, kept);
  const Modes modes = hinge ? Modes{Eigen::MatrixXd::Identity(rows.rows(), rows.rows()), rows.cast<double>()}
                            : principal(rows, options.least_mm, options.most_modes);
  out.mix = modes.mix.cast<float>();
  for (Eigen::Index m = 0; m < modes.mix.cols(); ++m) {
    const Eigen::RowVectorXf mode = modes.fields.row(m).cast<float>();
    const double largest_share = modes.mix.col(m).cwiseAbs().maxCoeff();
    out.scale.push_back(quantise({mode.data(), static_cast<std::size_t>(mode.size())},
                                 options.rounding_mm / largest_share, out.field));
  }
  return out;
}

float quantise(std::span<const float> mm, double rounding_mm, std::vector<std::int16_t>& out) {
  const float step = std::max(largest(mm) / kMost, 1e-12F);
  out.reserve(out.size() + mm.size());
  constexpr std::size_t block = 3 * PackedField::block;
  for (std::size_t first = 0; first < mm.size(); first += block) {
    const auto numbers = mm.subspan(first, std::min(block, mm.size() - first));
    int coarse = 1;  // steps
    while (std::lround(largest(numbers) / (step * static_cast<float>(coarse))) > kByte) coarse *= 2;
    if (static_cast<double>(step) * coarse / 2 > rounding_mm) coarse = 1;
    for (const float value : numbers)
      out.push_back(
          static_cast<std::int16_t>(coarse * std::lround(value / (step * static_cast<float>(coarse)))));
  }
  return step;
}

std::vector<float> field_of(const JointCorrection& correction, std::size_t s) {
  const std::size_t numbers = 3 * correction.node.size();
  std::vector<float> out(numbers, 0.0F);
  for (std::size_t m = 0; m < correction.scale.size(); ++m) {
    const float share =
        correction.mix(static_cast<Eigen::Index>(s), static_cast<Eigen::Index>(m)) * correction.scale[m];
    for (std::size_t i = 0; i < numbers; ++i)
      out[i] += share * static_cast<float>(correction.field[numbers * m + i]);
  }
  return out;
}

}  // namespace ecorche::correct
