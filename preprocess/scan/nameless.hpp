// SPDX-License-Identifier: Apache-2.0
// Labels that say nothing of what they are, known by their shape and their place beside a template's bones.
#pragma once

#include <map>
#include <vector>

#include "preprocess/scan/place_template.hpp"

namespace ecorche::scan {

/// One label: its voxels' means in cubes of kLabelCubes mm, LPS mm (label_points).
struct NamelessLabel {
  std::int64_t id = 0;
  std::size_t voxels = 0;
  Points points;
  double thickness = 0;                   ///< mm: twice its volume over its surface
  std::size_t outside = 0;                ///< faces of its voxels at the air around all labels
  std::map<std::size_t, std::size_t> at;  ///< faces of its voxels at those of other labels, by row
};

inline constexpr double kLabelCubes = 6;

/// Every value of `layer` but 0, in increasing order. `layer` has one component of whole numbers. O(voxels).
std::vector<NamelessLabel> label_points(const Image& layer, const Context& context);

/// The part of the field of view that any of the labels lies in or near: where none was drawn none is missed.
ImageGrid part_with_labels(const std::vector<NamelessLabel>& labels, const ImageGrid& whole);

/// What became of one label.
struct LabelMeaning {
  enum class Kind : std::uint8_t {
    other,     ///< no bone
    body,      ///< it holds the outside of all that is labelled
    shell,     ///< the same, some voxels thick
    bone,      ///< of one segment, or of the same on both sides
    bones,     ///< of several segments
    ambiguous  ///< it may be a bone
  };
  Kind kind = Kind::other;
  int bone = -1;            ///< row of the template's bones: the one that most of it lies at
  bool both_sides = false;  ///< that bone of the left, and of the right
  double on_bones = 0;      ///< share of it that lies at the template's bones
  double claim = 0;  ///< of the points that its size lets one expect, how many of the template are its own
  bool too_short = false;                            ///< for `bone`, a long one
  double confidence = 0;                             ///< 0 to 1
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< LPS mm
};

struct LabelMeanings {
  Placed placed;  ///< the template over what was taken as bones
  double score =
      0;  ///< 0 to 1: share of the template in view that is bone, times that of bone that lies at it
  std::vector<LabelMeaning> of;
};

/// Which labels are bones, and whose. Where the template lies is looked for among all labels: there, the
/// labels that lie on its bones with most of what they are cover as much of it as they can. To those it is
/// fitted (place_template), and they are classified anew, until nothing changes. What lies at a bone, but is
/// nearer to it nowhere than another label, is none (muscles, cords), except where bone encloses it (marrow).
/// What is far shorter than a long bone at which it lies is not that bone.
/// `score` is 0 where no label may be bone.
LabelMeanings know_labels(const BodyTemplate& body, const std::vector<NamelessLabel>& labels,
                          const ImageGrid& grid, Side side, const Context& context);

/// Where the template may lie among labels of which only some are bones.
struct RoughPlace {
  View view = View::body;
  Similarity place;
  double score = 0;                 ///< 0 to 1
  std::vector<std::size_t> likely;  ///< rows of the labels that may be bones there
};

/// First step of know_labels: the best places, the best first, at most kPlaces.
std::vector<RoughPlace> rough_places(const BodyTemplate& body, const std::vector<NamelessLabel>& labels,
                                     const ImageGrid& grid, Side side, const Context& context);

inline constexpr std::size_t kPlaces = 2;

}  // namespace ecorche::scan
