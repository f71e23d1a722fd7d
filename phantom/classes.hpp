// SPDX-License-Identifier: Apache-2.0
// The phantom's labels as programs of hospitals would have them: by their names, in their maps.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <ecorche/values/case.hpp>

namespace ecorche::phantom {

/// One label map of a program.
struct ClassMap {
  std::string task;  ///< `total`, `appendicular_bones`, `clin_ct_ribs`, ...
  Image image;       ///< u8
  std::map<std::int64_t, std::string>
      names;  ///< every class that the task knows here, also those without a voxel
};

enum class Segmenter : std::uint8_t {
  totalsegmentator,  ///< total, craniofacial_structures, appendicular_bones (without sides) and body
  moose,             ///< clin_ct_peripheral_bones, _vertebrae, _ribs, _organs and _body
};

/// `labels` are the phantom's. Bones that it has in one piece are cut where the program has several: a spine
/// into vertebrae, a rib cage into ribs and a sternum, a hand into carpals, metacarpals and fingers.
std::vector<ClassMap> segmented_by(Segmenter segmenter, const CaseLabels& labels);

}  // namespace ecorche::phantom
