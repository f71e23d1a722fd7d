// SPDX-License-Identifier: Apache-2.0
// A case: one patient as it was scanned, everything in LPS mm.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <ecorche/values/image.hpp>
#include <ecorche/values/joint_rule.hpp>
#include <ecorche/values/mesh.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche {

enum class Group : std::uint8_t { skin, bone, muscle, organ, vessel, nerve, cartilage, ligament, fat, other };

/// `skin`, `bone`, ... and back; throws Error{config} on an unknown word.
std::string_view group_name(Group group);
Group group_from_name(std::string_view name);

/// Which half of a label that covers both: split by a plane of constant x, LPS.
enum class Side : std::uint8_t { both, left, right };

/// Voxels of the case's label map whose boundary is to become a surface (preprocess/label_surfaces).
struct LabelSource {
  std::vector<std::int64_t> ids;        ///< empty: every label but 0, with hollows, without specks
  Side side = Side::both;               ///< left: voxels whose centre has x >= plane_mm
  double plane_mm = 0;                  ///< LPS
  double close_mm = 0;                  ///< gaps up to twice this wide are filled first
  std::shared_ptr<const Image> within;  ///< where given: only voxels whose value there, on the same grid, ...
  std::vector<std::int64_t> within_ids;  ///< ... is one of these
  std::string where;                     ///< file, line and key, for messages
};

// An entry has a surface, or a source that `label_surfaces::resolve` turns into one.

/// A bone, and the segment that moves it.
struct CaseBone {
  std::string name;
  std::string segment;  ///< owner
  SurfaceMesh surface;
  std::optional<LabelSource> source = {};
};

/// Anything that follows the body and is no bone.
struct CaseTissue {
  std::string name;
  Group group = Group::other;
  SurfaceMesh surface;
  std::optional<LabelSource> source = {};
  std::optional<double> stiffness_kpa = {};  ///< Young's modulus of the flesh in it
};

/// An image that follows the body.
struct CaseVolume {
  std::string name;
  Image image;
  double background = 0;  ///< what lies outside the body
};

/// Limbs that touch in the scan what they do not hang on, and are to move apart from it
/// (preprocess/label_surfaces/hold_apart.hpp).
struct HeldApart {
  /// Limbs of the same labels.
  struct Limbs {
    std::vector<std::int64_t> ids;      ///< labels that these limbs are made of
    std::vector<std::string> segments;  ///< the uppermost of each limb
    int joints = 2;                     ///< at most so many lie between what may touch
  };
  double gap_mm = 0;  ///< between voxel centres
  std::vector<Limbs> limbs;
  std::string where;  ///< file, line and key, for messages
};

/// A label per voxel, and what the ids mean.
struct CaseLabels {
  Image image;                                ///< integer scalars, one component; 0 is nothing
  std::map<std::int64_t, std::string> table;  ///< id -> name
  std::vector<Image> overlaps = {};           ///< further layers on the same grid, where labels overlap
  std::optional<HeldApart> apart = {};        ///< `label_surfaces::resolve` takes that out of the images
};

/// What becomes of limbs that touch in the scan what they do not hang on (preprocess/parting).
struct CaseContacts {
  bool cut = true;                                          ///< they come apart
  std::vector<std::pair<std::string, std::string>> joined;  ///< segments whose limbs stay joined all the same
};

/// One patient as scanned, read whole: LPS, mm.
struct Case {
  std::string name;
  Skeleton skeleton;
  std::vector<Region> regions = {};   ///< that the joints' rules name
  std::optional<BodySize> size = {};  ///< as the skeleton's file bounds it
  std::shared_ptr<const Skeleton> whole_spine =
      {};                           ///< what `skeleton` was split from (core/values/spine.hpp)
  bool ribs_apart = false;          ///< then: each rib is part of its vertebra
  std::set<std::string> ribs = {};  ///< bones that a vertebra carries: its joints are not theirs
  bool generic = false;  ///< no skeleton was given: `skeleton` lists the segments, and proximity joins them
  std::string skin_name = "skin";
  SurfaceMesh skin;
  std::optional<LabelSource> skin_source;
  std::vector<CaseBone> bones;
  std::vector<CaseTissue> tissues;  ///< without skin and bones
  std::vector<CaseVolume> volumes;
  std::optional<CaseLabels> labels;
  CaseContacts contacts = {};
  /// Young's modulus of flesh in no tissue that says its own; there wherever a tissue does.
  std::optional<double> stiffness_kpa = {};
  /// XXH64 of every file that was read, by path as written in the case: provenance of the model.
  std::map<std::string, std::uint64_t> input_digests;
};

}  // namespace ecorche
