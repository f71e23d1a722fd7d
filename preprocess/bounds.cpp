// SPDX-License-Identifier: Apache-2.0
#include "preprocess/bounds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "core/model_file/figures.hpp"
#include "core/values/text.hpp"

namespace ecorche::preprocess {
namespace {

constexpr std::optional<double> none = std::nullopt;
constexpr double kMan = 1700;  // mm

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
    Bound{"degenerate_tets", none, 0,
          "the map of a flat tet has no inverse, and that of one with an edge under 100 steps of float32 "
          "(0.006 "
          "mm at half a metre) is off by over 1 %"},
    Bound{
        "max_outside_mm", none, 50,
        "outside, the map of a tet a few mm wide is extrapolated; this far out it is usually another frame. "
        "Nearer ones are only warned of: tissues may stick out",
        Bound::Unit::length},
    Bound{
        "bone_tet_change", none, 1e-4,
        "weights are 1 in all of a bone (Sujar18 3.3): where its tets stretch, a posed volume's bone tears"},
    Bound{
        "bone_rigidity_mm", none, 4,
        "bones are rigid by definition; this is the rounding of float32, some 0.001 mm within two metres of "
        "the origin",
        Bound::Unit::grain},
};

}  // namespace

std::span<const Bound> bounds() {
  return kBounds;
}

BodySize body_size(const Model& model) {
  if (model.nodes.rows() == 0) return {};
  const Eigen::RowVector3d low = model.nodes.colwise().minCoeff().cast<double>();
  const Eigen::RowVector3d high = model.nodes.colwise().maxCoeff().cast<double>();
  BodySize size;
  size.length_mm = (high - low).maxCoeff();
  constexpr double kAbout = 500;  // mm, that it may be moved by
  const double farthest = low.cwiseAbs().cwiseMax(high.cwiseAbs()).maxCoeff();
  const auto grain = [](double at) { return std::exp2(std::floor(std::log2(at)) - 23); };
  size.grain_mm = farthest > 0 ? grain(farthest) : 0;
  size.posed_grain_mm = grain(farthest + size.length_mm + kAbout);
  return size;
}

std::string describe(const Bound& bound) {
  if (bound.most == 0.0) return "0";  // counts are not negative
  if (bound.unit == Bound::Unit::length)
    return "<= " + text::number(bound.most.value_or(0), 6) + " mm, 10 % under 0.5 m, 3 % over 1.7 m";
  if (bound.unit == Bound::Unit::grain)
    return "<= " + text::number(bound.most.value_or(0), 6) + " grains of float32";
  return bound.least ? ">= " + text::number(*bound.least, 6) : "<= " + text::number(*bound.most, 6);
}

std::vector<JudgedFigure> judge(const Certificate& certificate, const BodySize& size) {
  std::vector<JudgedFigure> figures;
  model_file::for_each_figure(certificate, [&](std::string_view name, auto figure) {
    const auto bound = std::find_if(kBounds.begin(), kBounds.end(),
                                    [&](const Bound& candidate) { return candidate.figure == name; });
    JudgedFigure& out = figures.emplace_back();
    out.figure = name;
    out.value = static_cast<double>(figure);
    if (bound == kBounds.end()) return;
    out.bound = &*bound;
    const double unit = bound->unit == Bound::Unit::grain ? size.posed_grain_mm : 1;
    if (bound->least) out.least = *bound->least * unit;
    if (bound->most) out.most = *bound->most * unit;
    // A part of a body may stick out by more of its own length than a whole one, but a mouse is no elephant.
    if (bound->unit == Bound::Unit::length)
      out.most = std::min(0.1 * size.length_mm, *bound->most * std::max(1.0, size.length_mm / kMan));
    out.kept = (!out.least || out.value >= *out.least) && (!out.most || out.value <= *out.most);
  });
  return figures;
}

std::vector<std::string> broken_bounds(const Certificate& certificate, const BodySize& size) {
  std::vector<std::string> broken;
  for (const JudgedFigure& figure : judge(certificate, size)) {
    if (figure.kept) continue;
    std::string bound = describe(*figure.bound);
    if (figure.bound->unit != Bound::Unit::plain) bound += " = " + text::number(*figure.most, 6);
    broken.push_back(std::string(figure.figure) + " is " + text::number(figure.value, 6) + ", the bound is " +
                     bound);
  }
  return broken;
}

}  // namespace ecorche::preprocess
