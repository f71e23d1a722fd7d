// SPDX-License-Identifier: Apache-2.0
// What becomes of a scan's labels: bones of segments, tissues, a skin; and what was guessed.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <ecorche/values/context.hpp>
#include "app/scan/scan_input.hpp"
#include "io/case/structures.hpp"

namespace ecorche::app {

struct ScanOptions {
  Side side = Side::both;         ///< of a scan of one limb
  double skin_hu = -300;          ///< denser than this is the patient, where no label says so
  double bone_hu = 226;           ///< denser than this is bone, where no label of any bone is there
  bool own_values = false;        ///< both of those are in the image's own values, which are no HU
  bool skin_from_labels = false;  ///< round all labels, where nothing better is there
  double bridge_mm = 6;           ///< what hangs on the patient by less is no part
};

/// What one label of the input became.
struct LabelFate {
  std::string from, name;  ///< file, and name there
  std::size_t voxels = 0;
  std::string became;  ///< in words: `femur_left, bone of thigh_left`; `left out: ...`
  std::string how;     ///< why that
  double confidence = 0;
};

/// A surface of the case.
struct ScanEntry {
  enum class Role : std::uint8_t { bone, tissue, body };
  std::string name;
  Role role = Role::tissue;
  std::string segment;  ///< of a bone
  Group group = Group::other;
  std::string how;
  double confidence = 1;
  std::size_t voxels = 0;
  std::vector<std::string> cut;  ///< at which borders of the image: `lower`, ...
  bool drawn = true;             ///< a surface of its own; else it only counts for the skin
};

struct ScanSkin {
  std::string how;  ///< where it comes from
  double confidence = 1;
  std::vector<std::string> caps;  ///< `the upper border: 312.5 cm2 at [..]`: flat there, and no skin
  double close_mm = 0;            ///< as the case says it
};

/// The whole case.
struct ScanCase {
  Image labels;  ///< u16; id i is `entries[i - 1]`
  std::vector<ScanEntry> entries;
  ScanSkin skin;
  std::string spine, ribs;  ///< `vertebrae`, where that is asked for (io/case/spine_choice.hpp)
  bool parted = false;      ///< bones were parted by a template, so that joints are less sure
  std::vector<LabelFate> fates;
  std::vector<std::string> notes;   ///< what a user should know, a line each
  std::vector<std::string> doubts;  ///< what should be looked at
};

/// Recognises, merges on one grid (finer structures before coarser ones, earlier files before later ones),
/// takes specks off, gives pieces their sides, finds the skin. Where no label names a bone and all are
/// known, bones come from the CT (ct_bones.hpp). Throws Error{data} where no bone is left, or no skin can be
/// found.
ScanCase decide(Scan& scan, const ScanOptions& options, const Context& context);

}  // namespace ecorche::app
