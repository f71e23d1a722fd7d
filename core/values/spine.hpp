// SPDX-License-Identifier: Apache-2.0
// A spine with a joint at each level in place of the four of `skeleton: human`.
#pragma once

#include <set>
#include <span>
#include <string>
#include <string_view>

#include <ecorche/values/skeleton.hpp>

namespace ecorche::spine {

/// A vertebra, or the head, and how far it turns on what is below it: degrees, of adults, all that bending
/// forth and back is together, of the others those to one side. White and Panjabi, Clinical Biomechanics of
/// the Spine (1990), representative values.
struct Level {
  std::string_view segment;  ///< `vertebra_l5`, or `head`
  std::string_view joint;    ///< `l5_s1`
  std::string_view part;     ///< the segment of `human` that its bones belong to
  std::string_view led_by;   ///< the segment of `human` whose joint it takes its share of
  double flexion = 0, lateral_bending = 0, rotation = 0;
};

/// From L5 up to the head.
std::span<const Level> levels();

/// Null where none is called so.
const Level* find_level(std::string_view segment);

/// The segment of `human` that a segment of the split spine is part of; any other is its own.
std::string whole_segment(const std::string& segment);

/// What ribs and sternum, as far as they are the `thorax`, ride on.
enum class Ribs : std::uint8_t {
  cage,       ///< ribs 1 to 10 are the thorax, as one: it rides on T6, the middle of those that they hang on
  vertebrae,  ///< each rib is part of its vertebra: the sternum is left, and rides on T4, amid ribs 1 to 7
};

/// `human`, fitted or not, with a segment for each level of `present`. Its joints lumbosacral,
/// thoracolumbar, cervicothoracic and atlantooccipital stay as they are, in `boneless` segments that move
/// nothing (lumbar_spine, thoracic_spine, cervical_spine, upper_cervical_spine), and each level follows one
/// of them by its share of the degrees above. The share of a level that is not `present` goes to the next one
/// above it that follows the same joint, else to the next below; where no vertebra of the thorax is, to the
/// thorax, and where none of the neck but the atlas is, to that. The levels' joints have neither centre nor
/// axes yet.
Skeleton split(const Skeleton& human, const std::set<std::string>& present, Ribs ribs);

}  // namespace ecorche::spine
