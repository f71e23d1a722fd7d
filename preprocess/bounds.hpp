// SPDX-License-Identifier: Apache-2.0
// The bounds beyond which a model is refused (DESIGN 7): a number and a reason each, said here once.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/values/model.hpp"

namespace ecorche::preprocess {

/// One figure of the certificate, under its stored name, and the interval that it must keep to; `nullopt` is
/// no bound on that side. A NaN keeps to none.
struct Bound {
  std::string_view figure;
  std::optional<double> least, most;
  std::string_view reason;

  bool kept(double value) const { return (!least || value >= *least) && (!most || value <= *most); }
};

/// All of them, in the order of the certificate's members. docs/model.md holds the same table, by a test.
std::span<const Bound> bounds();

/// `>= 0.5`, `<= 1`, or `0` where only that will do.
std::string said(const Bound& bound);

/// A figure of a certificate with the bound that it has, if any.
struct JudgedFigure {
  std::string_view figure;
  double value = 0;
  const Bound* bound = nullptr;  ///< null: the figure is told, not judged
  bool kept = true;
};

/// Every figure of a certificate, in its order.
std::vector<JudgedFigure> judge(const Certificate& certificate);

/// One line per broken bound; empty when the certificate keeps them all.
std::vector<std::string> broken_bounds(const Certificate& certificate);

}  // namespace ecorche::preprocess
