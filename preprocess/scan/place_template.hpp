// SPDX-License-Identifier: Apache-2.0
// Which part of a body a scan shows, and where each of its segments lies: a template laid over its bones.
#pragma once

#include <string_view>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>
#include "preprocess/scan/body_template.hpp"
#include "preprocess/scan/similarity.hpp"

namespace ecorche::scan {

/// What may be in view, and how limbs are held there.
enum class View : std::uint8_t { body, arms_up, leg_left, leg_right, arm_left, arm_right };

/// For a reader: `the left leg`.
std::string_view view_name(View view);
/// Whether one limb alone is in view.
inline bool one_limb(View view) {
  return view >= View::leg_left;
}

struct Placed {
  View view = View::body;
  std::vector<Similarity> segments;   ///< of each segment: template to scan
  std::vector<std::uint8_t> in_play;  ///< of each segment: whether `view` has it, and the scan seems to
  double misfit = 1;                  ///< 0 to 1: mean distance of scan and template, both ways, over kReach
  double scale = 1;                   ///< size of the patient over the template's
};

inline constexpr double kSmallest = 0.75, kLargest = 1.2;  ///< of the template's size
inline constexpr double kReach = 25;                       ///< mm: what is farther off counts as this far

/// `bone` are points on the scan's bones, LPS mm, evenly spread, about one in a cube of 8 mm (spread_points);
/// `grid` is the field of view: what lies beyond counts for nothing. With a side only a limb of that side is
/// looked for; else whatever is in view. The patient's axis is within about 30 degrees of z, a limb alone may
/// lie as it likes. Where along the body the view lies is tried in steps at several sizes; the best are then
/// fitted segment by segment (iterated nearest points, neighbours held together at their joints). The
/// answers, the best first, one for each view that was tried.
std::vector<Placed> place_template(const BodyTemplate& body, const Points& bone, const ImageGrid& grid,
                                   Side side, const Context& context);

/// The mean voxel of each cube of `mm` that holds voxels of `mask`, LPS mm.
Points spread_points(const std::vector<std::uint8_t>& mask, const ImageGrid& grid, double mm);

}  // namespace ecorche::scan
