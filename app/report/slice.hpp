// SPDX-License-Identifier: Apache-2.0
// A cut through the tets: bones, and whose weights rule where.
#pragma once

#include <vector>

#include <ecorche/values/model.hpp>
#include "app/report/picture.hpp"
#include "app/report/view.hpp"

namespace ecorche::app::report {

/// The plane through `view.centre`, seen along `view.toward`. A pixel in a tet shows the colours of the
/// segments, mixed by their weights there; bone is paler, with a dark rim; thin dark lines part the regions
/// where another segment has the largest weight. Pixels in no tet keep the ground. O(#T + pixels).
Picture slice(const Model& model, const View& view, const Colour& ground);

/// The same through a sheet that bends: pixels of row r lie `depth[r]` mm before that plane, towards the
/// viewer.
Picture slice(const Model& model, const View& view, const Colour& ground, const std::vector<double>& depth);

/// How far before the view's plane the bones lie in each of its rows, in the mean, mm; where a row has none,
/// as its neighbours; smooth from row to row. Without bones 0.
std::vector<double> depth_of_bones(const Model& model, const View& view);

}  // namespace ecorche::app::report
