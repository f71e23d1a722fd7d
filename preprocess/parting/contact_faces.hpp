// SPDX-License-Identifier: Apache-2.0
// Where flesh of a limb hangs together with what the limb does not hang on.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include <ecorche/values/model.hpp>
#include "preprocess/parting/limb_parts.hpp"

namespace ecorche::parting {

/// A limb against another, or against the rest of the body.
struct Contact {
  int limb = -1;        ///< its uppermost segment
  int other_limb = -1;  ///< that of the other, which comes later in the skeleton; -1: the rest of the body
  int own = -1;         ///< the segment of the limb that moves most of what touches, ...
  int other = -1;       ///< ... and that of the other
  double area_mm2 = 0;  ///< of what lies in the body
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< a place of it near its middle, mm
  double confidence = 0;
};

/// Where each limb hangs, by its uppermost segment: its joint, and the way from there to the skin, mm.
struct LimbRoot {
  Eigen::Vector3d joint = Eigen::Vector3d::Zero();
  double way = 0;
};

/// Faces where the body is to be cut, each from the tet of the contact's `limb`.
struct Contacts {
  std::vector<Contact> contacts;
  std::vector<Face> faces;
  std::vector<std::int32_t> contact_of;  ///< #faces
};

/// Two limbs that stay joined where they touch, by their uppermost segments; -1: the rest of the body.
using Joined = std::vector<std::pair<int, int>>;

/// A face between tets of two parts is contact where it lies farther from the limb's joint than 1.75 times
/// the way from there to the skin, and between two limbs anywhere; they are told, and cut, where at least
/// `least_mm2` of theirs lie beyond 3.5 times it (between two limbs: 2.2 times, of either), and what else
/// such a limb touches beyond 3.5 times it. Confidence: 0.97 beyond 3.5 times that way, falling to 1/2
/// at 1.75 times; 0.9 at least between two limbs. Pairs in `joined` are left out.
Contacts find_contacts(const Flesh& flesh, const std::vector<std::int16_t>& part, const SolidFaces& solid,
                       const std::vector<LimbRoot>& roots, double least_mm2, const Joined& joined);

}  // namespace ecorche::parting
