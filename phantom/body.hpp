// SPDX-License-Identifier: Apache-2.0
// The phantom's body: where the joints are, and the solids built around them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/skeleton.hpp>
#include "phantom/shape.hpp"

namespace ecorche::phantom {

/// Joint centres and axes of the left half in LPS mm, floor at z = 0, midline at x = 0. The right half is its
/// mirror image.
struct Landmarks {
  Vec hip, knee, ankle, ball;  ///< leg; `ball` is the row of toe joints
  Vec sternoclavicular, shoulder, elbow, wrist;
  Vec root, lumbar, thorax, neck, head;   ///< on the midline
  Vec knee_axis, ankle_axis, elbow_axis;  ///< unit; to the patient's left at rest
  Eigen::Matrix3d foot;                   ///< columns: left, back, up
  Eigen::Matrix3d hand;      ///< columns: back of the hand, ulnar (little finger), towards the elbow
  double elbow_flexion = 0;  ///< radians, at rest
  double fat = 0;            ///< mm over the muscles
};

/// What makes one body differ from another.
struct Proportions {
  double leg = 1, arm = 1;           ///< of the longest limbs of the plain phantom
  double fat = 5;                    ///< mm over the muscles
  double height = 1;                 ///< all lengths, over those of the plain phantom
  std::vector<std::string> missing;  ///< organs that were taken out, and bones that nobody has drawn
};

/// The plain phantom's: limbs up to 2.5 % shorter than the longest, 5 to 8 mm of fat, nothing missing; it
/// fits into 620 x 300 x 1745 mm.
Proportions plain_proportions(std::uint64_t seed);

/// Those of a population: 1.53 to 1.90 m tall, limbs from 7 % shorter to 2 % longer, 4 to 14 mm of fat; of
/// every four bodies one lacks a part, and one of every sixteen two.
Proportions varied_proportions(std::uint64_t seed);

/// `height` is not in it: it scales what is made of them (phantom.cpp).
Landmarks make_landmarks(const Proportions& of);
/// Of the plain phantom.
inline Landmarks make_landmarks(std::uint64_t seed) {
  return make_landmarks(plain_proportions(seed));
}

constexpr double kFemoralHead = 24, kHumeralHead = 22.5;  ///< radii of the true spheres, mm
constexpr double kBallGap = 4.5;                          ///< between a head and its socket, mm
constexpr double kGap = 5;                                ///< between bones of different segments, mm
constexpr double kKneeRadius = 22, kElbowRadius = 11, kAnkleRadius = 17;  ///< of the condyles' cylinders

/// One solid of the body.
struct Part {
  std::string name;
  Group group = Group::other;
  std::string segment;  ///< of a bone
  Shape shape;
  Shape outline;           ///< of a muscle: before anything was taken away from it, for the skin over it
  double detail = 0;       ///< mm: the thinnest radius that the lattice must not lose
  double hounsfield = 0;   ///< of its inside
  int small_vertices = 0;  ///< share of the small phantom
  int mirror_of = -1;      ///< row of the part of which this one is the mirror image
};

/// Bones of the whole body, by segment from the root out; no two of different segments come closer than
/// kBallGap.
std::vector<Part> make_bones(const Landmarks& at);

/// The solids that tissues must not enter: bones grown by a margin, and the spaces in which joints move.
Shape make_keepout(const Landmarks& at, const std::vector<Part>& bones);

/// The rib cage's outer surface, filled.
Shape thorax_envelope();

/// The main arteries and veins: two trees.
std::vector<Part> make_vessels(const Landmarks& at);
std::vector<Part> make_organs(const Landmarks& at, const std::vector<Part>& bones,
                              const std::vector<Part>& vessels);
/// `keepout` as above; muscles also give way to `neighbours` and to each other. `scapula` is the left one:
/// those of the back lie on it.
std::vector<Part> make_muscles(const Landmarks& at, const Shape& scapula, const Shape& keepout,
                               const std::vector<Part>& neighbours);

/// The outside of everything, at least a few mm over bones, muscles and vessels.
Part make_skin(const Landmarks& at, const std::vector<Part>& bones, const std::vector<Part>& muscles,
               const std::vector<Part>& vessels);

/// Everything, ready to be sampled.
struct Body {
  Landmarks at;
  Part skin;
  std::vector<Part> parts;  ///< muscles, organs, vessels, bones: the last one wins where two share a voxel
};
Body make_body(const Proportions& of);
/// Of the plain phantom.
inline Body make_body(std::uint64_t seed) {
  return make_body(plain_proportions(seed));
}

/// The virtual skeleton. `patient` leaves hips and shoulders to a sphere fit; else every centre is given.
Skeleton make_skeleton(const Landmarks& at, bool patient);

/// The part of that name; throws Error{internal}.
const Part& find_part(const std::vector<Part>& parts, std::string_view name);

/// Appends `part`, renamed NAME_left, and its mirror image NAME_right.
void add_pair(std::vector<Part>& parts, Part part);

}  // namespace ecorche::phantom
