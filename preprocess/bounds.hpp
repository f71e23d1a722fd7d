// SPDX-License-Identifier: Apache-2.0
// The bounds beyond which a model is refused: a number and a reason each, said here once.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ecorche/values/model.hpp>

namespace ecorche::preprocess {

/// How large a body is, and how fine the places are that float32 has for it: what lengths are judged by, so
/// that a mouse is judged as an elephant, and a body far from the origin as one beside it.
struct BodySize {
  double length_mm = 0;       ///< the largest extent of its nodes
  double grain_mm = 0;        ///< between neighbouring floats at its farthest coordinate, mm
  double posed_grain_mm = 0;  ///< the same farther from the origin by its length and half a metre: posed
};
/// Of a model's nodes. O(#nodes).
BodySize body_size(const Model& model);

/// One figure of the certificate, under its stored name, and the interval that it must keep to; `nullopt` is
/// no bound on that side.
struct Bound {
  /// What `least` and `most` are told in. `length`: mm of a man of 1.7 m, as much more of what is longer, and
  /// never more than a tenth of the length.
  enum class Unit : std::uint8_t { plain, length, grain };

  std::string_view figure;
  std::optional<double> least, most;
  std::string_view reason;
  Unit unit = Unit::plain;
};

/// All of them, in the order of the certificate's members. docs/reference/model.md holds the same table, by a
/// test.
std::span<const Bound> bounds();

/// `>= 0.5`, `<= 1`, `<= 4 grains of float32`, or `0` where only that will do.
std::string describe(const Bound& bound);

/// A figure of a certificate with the bound that it has, if any.
struct JudgedFigure {
  std::string_view figure;
  double value = 0;
  const Bound* bound = nullptr;       ///< null: the figure is told, not judged
  std::optional<double> least, most;  ///< of this body, in the figure's own unit
  bool kept = true;                   ///< a NaN keeps to nothing
};

/// Every figure of a certificate, in its order.
std::vector<JudgedFigure> judge(const Certificate& certificate, const BodySize& size);

/// One line per broken bound; empty when the certificate keeps them all.
std::vector<std::string> broken_bounds(const Certificate& certificate, const BodySize& size);

}  // namespace ecorche::preprocess
