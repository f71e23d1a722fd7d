// SPDX-License-Identifier: Apache-2.0
// Limbs whose tets hang together with what they do not hang on: arms at the sides, legs side by side.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include <ecorche/values/model.hpp>

namespace ecorche::check {

/// One limb joined to the rest of the body, or to another limb, far from its own joint.
struct Touch {
  int limb = -1;        ///< its uppermost segment
  int other_limb = -1;  ///< the uppermost segment of the other limb; -1: the rest of the body
  int own = -1;         ///< the segment of the limb whose bones most of the contact is nearest to, ...
  int other = -1;       ///< ... and the like segment of what it touches
  double area_mm2 = 0;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< on the contact, near its middle, mm
};

/// What of a body is read: its rig, mesh with labels and weights, and skin.
struct TouchInput {
  const Skeleton& skeleton;
  const std::vector<std::int32_t>& bone_segment;  ///< of each bone
  const PointsF& nodes;
  const Tets& tets;
  const std::vector<std::uint16_t>& tet_label;  ///< as TetMesh::label
  const Weights& weights;
  PointsF skin;  ///< outer_vertices of it
};

/// The vertices of a skin without those of its hollows: parts that turn inwards.
PointsF outer_vertices(const PointsF& V, const Triangles& F);

/// From a limb's joint, in ways from there to the skin (way_to_skin): of a body that stands free no contact
/// with the trunk, and none of two limbs, reaches so far.
inline constexpr double sure_ways = 3.5, sure_ways_of_two = 2.2;
/// So much must lie beyond, mm2: 10 cm2 of a body of 1.7 m.
double least_contact_mm2(double body_length_mm);

/// How far the skin is from a joint, mm: the distance that it has in the nearest twentieth of the directions
/// in which there is skin, so that a fold or the gap beside a hand does not count. Infinite without skin.
/// O(#V).
double way_to_skin(const PointsF& skin, const Eigen::Vector3d& joint);

/// For every segment the uppermost segment of the limb that it is of; -1: of none. A limb begins at the
/// uppermost segment of each chain whose joint turns by more than 100 degrees about one of its angles (hips
/// and shoulders; no joint of the spine).
std::vector<int> limbs_of(const Skeleton& skeleton);

/// Both are dragged along by either when the limb moves. Its share u of a node is the sum of the weights of
/// all its segments, which is harmonic: 1 on its bones, 0 on all others; so weights by whole limbs do as
/// well. Where u = 1/2 it ends; that lies about its joint, unless something touches: what lies farther from
/// the joint than 2.5 times the way from there to the skin is contact, where 10 cm2 of a body of 1.7 m (the
/// like share of others) lie beyond 3.5 times it; between two limbs 1.75 and 2.2 times. By limbs; the larger
/// side of two limbs. O(limbs * (#nodes + #tets)); the same for any number of threads.
std::vector<Touch> touching_limbs(const TouchInput& body);
std::vector<Touch> touching_limbs(const Model& model);

/// `touches the trunk: 47 cm2 joined, most of hand_left and pelvis`.
std::string what(const Touch& touch, const Skeleton& skeleton);
/// `upper_arm_left touches the trunk: 47 cm2 joined, most of hand_left and pelvis, at [x, y, z]`.
std::string describe(const Touch& touch, const Skeleton& skeleton);

/// The side, mm, of cubes of twelve tets: the body's volume over its tets.
double cube_mm(const PointsF& nodes, const Tets& tets);

/// What to do about it, for tets of that size.
std::string parting_advice(double cube_mm);

}  // namespace ecorche::check
