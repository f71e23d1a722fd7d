// SPDX-License-Identifier: Apache-2.0
// First step: what each label is called in the case.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "app/scan/scan_case.hpp"

namespace ecorche::app {

/// A structure of the case to be, and the labels that it is made of.
struct Named {
  std::string name;  ///< with its side, where it has one
  const io::Structure* structure = nullptr;
  Side side = Side::both;
  Group group = Group::other;
  std::string how;
  double confidence = 0;
  int rank = 0;  ///< the lower comes first where labels overlap
};

/// Which of `Named` each label of each map is; `no_entry` where it is left out.
struct LabelNames {
  static constexpr std::size_t no_entry = static_cast<std::size_t>(-1);
  std::vector<Named> named;
  std::vector<std::map<std::int64_t, std::size_t>> of_map;
  std::vector<LabelFate> fates;                              ///< of every label that its map holds
  std::vector<std::map<std::int64_t, std::size_t>> fate_of;  ///< by map and id: a row of `fates`
};

/// A structure that several maps have is the first one's; one with sides comes before one without.
LabelNames name_labels(const Scan& scan);

}  // namespace ecorche::app
