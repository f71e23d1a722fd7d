// SPDX-License-Identifier: Apache-2.0
// The frame and unit of a file, and the way from there to LPS mm.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>

#include <ecorche/values/mesh.hpp>

namespace ecorche::io {

struct Frame {
  Eigen::Matrix3d axes =
      Eigen::Matrix3d::Identity();  ///< signed permutation; column i is the file's axis i in LPS
  double unit_mm = 1;

  bool is_lps_mm() const { return unit_mm == 1 && axes == Eigen::Matrix3d::Identity(); }
  bool left_handed() const { return axes.determinant() < 0; }
  Eigen::Vector3d point(const Eigen::Vector3d& p) const { return unit_mm * (axes * p); }

  /// Into LPS mm; a left-handed frame flips the triangles, so that they keep facing outward.
  void apply(SurfaceMesh& mesh) const {
    if (is_lps_mm()) return;
    mesh.V = (mesh.V * (unit_mm * axes.transpose())).eval();
    if (left_handed()) mesh.F.col(1).swap(mesh.F.col(2));
  }
};

/// The axes that three letters name, such as LSA: x to the Left, y Superior, z Anterior. Nothing for anything
/// but the 48 codes.
inline std::optional<Eigen::Matrix3d> axes_from_code(std::string_view code) {
  constexpr std::string_view towards = "LPS", away = "RAI";
  if (code.size() != 3) return std::nullopt;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  for (Eigen::Index column = 0; column < 3; ++column) {
    const char letter = code[static_cast<std::size_t>(column)];
    const std::size_t plus = towards.find(letter), minus = away.find(letter);
    if (plus == towards.npos && minus == away.npos) return std::nullopt;
    const auto row = static_cast<Eigen::Index>(plus != towards.npos ? plus : minus);
    if (!axes.row(row).isZero()) return std::nullopt;
    axes(row, column) = plus != towards.npos ? 1 : -1;
  }
  return axes;
}

/// Millimetres of a unit: um, mm, cm, m, in, or a positive number (25.4) that says it.
inline std::optional<double> unit_from_name(std::string_view name) {
  if (name == "um") return 1e-3;
  if (name == "mm") return 1.0;
  if (name == "cm") return 10.0;
  if (name == "m") return 1000.0;
  if (name == "in") return 25.4;
  double millimetres = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), millimetres);
  if (error != std::errc() || end != name.data() + name.size()) return std::nullopt;
  return millimetres > 1e-9 && millimetres < 1e9 ? std::optional(millimetres) : std::nullopt;
}

}  // namespace ecorche::io
