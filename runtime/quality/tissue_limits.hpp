// SPDX-License-Identifier: Apache-2.0
// How much of its volume a tissue may win or lose in a pose, by its group.
#pragma once

#include <array>
#include <string_view>

#include <ecorche/values/case.hpp>

namespace ecorche::runtime {

struct TissueLimit {
  Group group = Group::other;
  double max_volume_change = 0;  ///< |posed - rest| / rest of the enclosed volume
  std::string_view because;      ///< what the figure rests on
};

inline constexpr std::size_t group_count = 10;

/// A row for every group, in the order of Group. docs/reference/quality.md holds the same table.
const std::array<TissueLimit, group_count>& tissue_limits();

/// The limit of one group.
double tissue_limit(Group group);

}  // namespace ecorche::runtime
