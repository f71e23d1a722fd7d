// SPDX-License-Identifier: Apache-2.0
// A case's `spine: vertebrae` and `ribs: vertebrae`.
#pragma once

#include <string>

#include <ecorche/values/case.hpp>
#include "io/case/yaml_reader.hpp"

namespace ecorche::io {

/// Splits the spine of `patient`, whose skeleton is read, where `root` asks for it. Throws Error{config}
/// where the skeleton is none that can be split, or where ribs go with vertebrae that are not split.
void read_spine(const yaml::Value& root, Case& patient);

/// Gives a bone its segment_in_spine(); ribs of vertebrae are noted (`Case::ribs`).
void put_in_spine(CaseBone& bone, Case& patient);

/// Once all bones are in: ribs whose vertebra is no bone of the case go to the next one above that is, else
/// to the next below, else to the thorax.
void join_lone_ribs(Case& patient);

/// The segment of a split spine that a bone of `segment` belongs to, by its name: `vertebra_l3`,
/// `third_lumbar_vertebra` and `vertebrae_L3` of `lumbar` to vertebra_l3, with what a disc is called by its
/// vertebra; ribs 11 and 12, and the others where `ribs_apart`, to their vertebra; of the lumbar spine and
/// the neck what names no level to the lowest. Segments outside the spine stay.
std::string segment_in_spine(const std::string& bone, const std::string& segment, bool ribs_apart);

}  // namespace ecorche::io
