// SPDX-License-Identifier: Apache-2.0
// Tables of labels as JSON: MOOSE's `organ_indices.json`, nnU-Net's `dataset.json`, and plain `{"1":
// "femur"}`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "io/image/segment_codes.hpp"

namespace ecorche::io {

struct JsonLabels {
  std::map<std::int64_t, std::string> names;   ///< as the file spells them, without label 0
  std::map<std::int64_t, SegmentCodes> codes;  ///< of those for which it gives a SNOMED code
};

/// Throws Error{missing_input} or Error{data}: no JSON, or none of labels.
JsonLabels read_label_json(const std::filesystem::path& path);

}  // namespace ecorche::io
