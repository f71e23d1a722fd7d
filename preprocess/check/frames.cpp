// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/frames.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace ecorche::check {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::array<double, 7> kScales{1, 10, 0.1, 1000, 0.001, 100, 0.01};

// All signed permutations: the identity, RAS and LSA, which most wrong files are in; then those that keep
// left and right, then the other turns, then the mirrored ones. A body is nearly its own mirror image: the
// first wins.
std::vector<Matrix3d> axis_changes() {
  std::vector<Matrix3d> out;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3d m = Matrix3d::Zero();
      for (int row = 0; row < 3; ++row)
        m(row, order[static_cast<std::size_t>(row)]) = (signs >> row & 1) != 0 ? -1 : 1;
      out.push_back(m);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  std::stable_sort(out.begin(), out.end(), [](const Matrix3d& a, const Matrix3d& b) {
    const auto rank = [](const Matrix3d& m) {
      if (m.isIdentity()) return 0;
      const std::string code = Agreement{m, 1, 0}.code();
      if (code == "RAS" || code == "LSA") return 1;
      return m.determinant() < 0 ? 4 : m(0, 0) > 0 ? 2 : 3;
    };
    return rank(a) < rank(b);
  });
  return out;
}

}  // namespace

std::string Agreement::code() const {
  // Column k says where axis k of the file points in LPS.
  std::string out;
  for (int k = 0; k < 3; ++k) {
    for (int row = 0; row < 3; ++row) {
      if (axes(row, k) > 0) out += "LPS"[row];
      if (axes(row, k) < 0) out += "RAI"[row];
    }
  }
  return out;
}

std::string Agreement::turn() const {
  std::string out = "(x, y, z) -> (";
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) {
      if (axes(row, k) != 0) out += std::string(axes(row, k) < 0 ? "-" : "") + "xyz"[k];
    }
    out += row < 2 ? ", " : ")";
  }
  return out;
}

std::string Agreement::size() const {
  if (scale == 1) return "";
  if (scale > 1) return "made " + std::to_string(std::lround(scale)) + " times larger";
  return "made " + std::to_string(std::lround(1 / scale)) + " times smaller";
}

std::optional<Agreement> find_agreement(const std::vector<Vector3d>& points, const Inside& skin,
                                        double skin_mm, double least, double better) {
  if (points.empty() || !(skin_mm > 0)) return std::nullopt;
  Vector3d low = points[0], high = points[0];
  for (const Vector3d& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const double span = (high - low).maxCoeff() / skin_mm;
  const auto fits = [](double share_of_skin) { return share_of_skin >= 0.15 && share_of_skin <= 1.5; };
  Agreement best;
  double alone = 0;
  for (const double scale : kScales) {
    if (scale != 1 && (fits(span) || !fits(span * scale))) continue;
    for (const Matrix3d& axes : axis_changes()) {
      std::size_t inside = 0, outside = 0;
      const double worth = std::max(best.share, least);  // the rest may lie outside
      for (const Vector3d& p : points) {
        ++(skin(scale * (axes * p)) ? inside : outside);
        if (static_cast<double>(outside) > (1 - worth) * static_cast<double>(points.size()) &&
            !(scale == 1 && axes.isIdentity()))
          break;
      }
      const double share = static_cast<double>(inside) / static_cast<double>(points.size());
      if (scale == 1 && axes.isIdentity()) alone = share;
      // Points that were shrunk into one place of the body do not agree with it, however well they lie
      // inside.
      if (inside + outside == points.size() && fits(span * scale) && share > best.share + 1e-9)
        best = {axes, scale, share};
    }
  }
  const bool changed = best.scale != 1 || !best.axes.isIdentity();
  if (!changed || best.share < least || (fits(span) && best.share < alone + better)) return std::nullopt;
  return best;
}

std::vector<Vector3d> sample_vertices(const SurfaceMesh& mesh, Eigen::Index most) {
  std::vector<Vector3d> out;
  const Eigen::Index step = std::max<Eigen::Index>(1, (mesh.V.rows() + most - 1) / most);
  for (Eigen::Index v = 0; v < mesh.V.rows(); v += step) out.emplace_back(mesh.V.row(v).transpose());
  return out;
}

double unit_factor(double length_mm, double low, double high) {
  for (const double factor : {10.0, 0.1, 1000.0, 0.001, 100.0, 0.01}) {
    if (length_mm * factor >= low && length_mm * factor <= high) return factor;
  }
  return 0;
}

}  // namespace ecorche::check
