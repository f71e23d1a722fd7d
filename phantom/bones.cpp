// SPDX-License-Identifier: Apache-2.0
// All bones together, with the gaps between segments.
#include "phantom/bones.hpp"

namespace ecorche::phantom {

namespace {

constexpr double kCortical = 1100;  ///< HU; the volume fills the inside with spongy bone

Part bone(std::string name, std::string segment, Shape shape, double detail, int small_vertices) {
  Part part;
  part.name = std::move(name);
  part.group = Group::bone;
  part.segment = std::move(segment);
  part.shape = std::move(shape);
  part.detail = detail;
  part.hounsfield = kCortical;
  part.small_vertices = small_vertices;
  return part;
}

/// A bone gives way to those of the next segment. A little less than the gap, so that surfaces made
/// concentric to a joint, which keep exactly that gap, are not scratched.
Shape clear_of(const Shape& bone, const std::vector<Shape>& next, double gap) {
  return subtract(bone, grow(unite(next), gap - 0.5), 1);
}

}  // namespace

std::vector<Part> make_bones(const Landmarks& at) {
  const Shape toes = toe_bone(at), hand = hand_bone(at), skull = skull_bone(at), mandible = mandible_bone(at);
  const Shape foot = clear_of(foot_bone(at), {toes}, kGap);
  const Shape tibia = clear_of(tibia_bone(at), {foot}, kGap),
              fibula = clear_of(fibula_bone(at), {foot}, kGap);
  const Shape patella = patella_bone(at);
  const Shape femur = clear_of(femur_bone(at), {tibia, fibula, patella}, kGap);
  const Shape ulna = clear_of(ulna_bone(at), {hand}, kGap), radius = clear_of(radius_bone(at), {hand}, kGap);
  const Shape humerus = clear_of(humerus_bone(at), {ulna, radius}, kGap);
  const Shape scapula = clear_of(scapula_bone(at), {humerus}, kBallGap);
  const Shape clavicle = subtract(clear_of(clavicle_bone(at), {humerus}, kGap), grow(scapula, 3));
  const Shape neck = clear_of(cervical_spine(at), {skull, mandible}, kGap);
  const Shape ribs =
      clear_of(rib_cage(at), {neck, scapula, clavicle, mirrored(scapula), mirrored(clavicle)}, kGap);
  const Shape lumbar = clear_of(lumbar_spine(at), {ribs}, kGap);
  const Shape pelvis = clear_of(pelvis_bone(at), {lumbar, femur, mirrored(femur)}, kBallGap);

  std::vector<Part> bones;
  bones.push_back(bone("pelvis", "pelvis", pelvis, 7, 378));
  bones.push_back(bone("lumbar_spine", "lumbar", lumbar, 6, 135));
  bones.push_back(bone("rib_cage", "thorax", ribs, 4.5, 765));
  bones.push_back(bone("cervical_spine", "neck", neck, 4, 117));
  bones.push_back(bone("skull", "head", skull, 5, 306));
  bones.push_back(bone("mandible", "head", mandible, 6, 63));
  add_pair(bones, bone("clavicle", "girdle", clavicle, 6, 31));
  add_pair(bones, bone("scapula", "girdle", scapula, 4, 110));
  add_pair(bones, bone("humerus", "upper_arm", humerus, 9, 110));
  add_pair(bones, bone("radius", "forearm", radius, 6.5, 51));
  add_pair(bones, bone("ulna", "forearm", ulna, 6.5, 60));
  add_pair(bones, bone("hand_bones", "hand", hand, 3.6, 153));
  add_pair(bones, bone("femur", "thigh", femur, 12, 144));
  add_pair(bones, bone("patella", "shank", patella, 7, 20));
  add_pair(bones, bone("tibia", "shank", tibia, 10, 85));
  add_pair(bones, bone("fibula", "shank", fibula, 6, 37));
  add_pair(bones, bone("foot_bones", "foot", foot, 5, 128));
  add_pair(bones, bone("toe_bones", "toes", toes, 4.2, 68));
  return bones;
}

Shape make_keepout(const Landmarks& at, const std::vector<Part>& bones) {
  std::vector<Shape> all;
  for (const Part& part : bones) all.push_back(part.shape);
  std::vector<Shape> joints{
      sphere(at.hip, kFemoralHead + 13),
      sphere(at.shoulder, kHumeralHead + 11),
      cylinder(at.knee - 48 * at.knee_axis, at.knee + 48 * at.knee_axis, kKneeRadius + 12, 6),
      cylinder(at.elbow - 32 * at.elbow_axis, at.elbow + 32 * at.elbow_axis, kElbowRadius + 9, 5),
      cylinder(at.ankle - 26 * at.ankle_axis, at.ankle + 26 * at.ankle_axis, kAnkleRadius + 10, 5),
      sphere(at.wrist, 15)};
  const Shape left = unite(joints);
  return unite({grow(unite(all), 3), left, mirrored(left)});
}

}  // namespace ecorche::phantom
