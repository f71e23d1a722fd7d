// SPDX-License-Identifier: Apache-2.0
#include "preprocess/bounds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "core/model_file/figures.hpp"

namespace ecorche::preprocess {
namespace {

constexpr std::optional<double> none = std::nullopt;

constexpr std::array kBounds{
    Bound{"solver_residual", none, 1e-8,
          "a direct factor reaches some 1e-12; what is far above was not solved"},
    Bound{"solved_min_weight", -1e-3, none,
          "the maximum principle holds for the equation and nearly for its elements: beyond, the mesh is to "
          "blame"},
    Bound{"solved_max_weight", none, 1 + 1e-3, "as for the smallest"},
    Bound{"solved_row_sum_error", none, 1e-9, "a direct factor keeps row sums to some 1e-13"},
    Bound{"repaired_largest_change", none, 1e-2,
          "it moves a node by 1 % of what its bones differ; more is another solution"},
    Bound{"min_weight", 0, none, "a weight is a share"},
    Bound{"max_weight", none, 1, "a weight is a share"},
    Bound{"row_sum_error", none, 1e-6, "a row that misses 1 moves a body far from the origin as a whole"},
    Bound{
        "min_dihedral_deg", 0.5, none,
        "the map of a sliver magnifies rounding by about 1 / sin(angle): here by 115, so that float32 nodes "
        "(1e-4 mm at one metre) still give 0.01 mm"},
    Bound{"inverted_tets", none, 0,
          "volumes are posed by the inverse of each tet's map, and an inverted tet covers its neighbours"},
    Bound{"degenerate_tets", none, 0, "the map of a flat tet has no inverse"},
    Bound{
        "max_outside_mm", none, 50,
        "outside, the map of a tet a few mm wide is extrapolated; this far out it is usually another frame. "
        "Nearer ones are only warned of: tissues may stick out"},
    Bound{"bone_rigidity_mm", none, 1e-3,
          "bones are rigid by definition; this is ten times float32 rounding at two metres"},
};

std::string number(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

}  // namespace

std::span<const Bound> bounds() {
  return kBounds;
}

std::string said(const Bound& bound) {
  if (bound.most == 0.0) return "0";  // counts are not negative
  return bound.least ? ">= " + number(*bound.least) : "<= " + number(*bound.most);
}

std::vector<JudgedFigure> judge(const Certificate& certificate) {
  std::vector<JudgedFigure> figures;
  model_file::for_each_figure(certificate, [&](std::string_view name, auto figure) {
    const auto bound = std::find_if(kBounds.begin(), kBounds.end(),
                                    [&](const Bound& candidate) { return candidate.figure == name; });
    const auto value = static_cast<double>(figure);
    const bool judged = bound != kBounds.end();
    figures.push_back({name, value, judged ? &*bound : nullptr, !judged || bound->kept(value)});
  });
  return figures;
}

std::vector<std::string> broken_bounds(const Certificate& certificate) {
  std::vector<std::string> broken;
  for (const JudgedFigure& figure : judge(certificate)) {
    if (figure.kept) continue;
    broken.push_back(std::string(figure.figure) + " is " + number(figure.value) + ", the bound is " +
                     said(*figure.bound));
  }
  return broken;
}

}  // namespace ecorche::preprocess
