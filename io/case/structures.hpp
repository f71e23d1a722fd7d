// SPDX-License-Identifier: Apache-2.0
// What a label of a segmentation means: which structure, of which side, and what that becomes in a case.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <ecorche/values/case.hpp>
#include "io/image/segment_codes.hpp"

namespace ecorche::io {

/// A line of io/case/data/structures.txt.
struct Structure {
  enum class Becomes : std::uint8_t { bone, tissue, background, body, shell, nothing };
  std::string name;
  Becomes becomes = Becomes::tissue;
  std::string segment;  ///< of a bone, without its side
  bool sided = false;   ///< `segment` needs a side behind it: thigh_left
  bool coarse = false;  ///< labels of its parts come before it
  Group group = Group::other;
  std::string code;  ///< SNOMED CT; may be empty
};

/// All, in the file's order.
const std::vector<Structure>& structures();

/// What was made of a label's name and codes.
struct Recognised {
  const Structure* structure = nullptr;  ///< null: not known
  Side side = Side::both;                ///< that its name or its codes say
  Group group = Group::other;            ///< where no structure is known: what a word of its name tells
  double confidence = 0;                 ///< 1: sure; 0: nothing was found
  std::string how;                       ///< in words, for a reader: `name`, `SNOMED 71341001`, ...
};

/// By its code where there is one that is known, else by its name: as it stands, by its other names, without
/// words that only tell a part (`cortical`, `upper half`), and by what it begins with. `code` may be null.
Recognised recognise(std::string_view name, const SegmentCodes* code = nullptr);

}  // namespace ecorche::io
