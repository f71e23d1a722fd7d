// SPDX-License-Identifier: Apache-2.0
// Several label maps become one, in an order of precedence.
#pragma once

#include <set>
#include <vector>

#include "io/image/segmentation.hpp"

namespace ecorche::io {

/// Takes labels out of a map: their voxels become 0, their names and codes go.
void leave_out(Segmentation& map, const std::set<std::int64_t>& ids);

/// One map of all, on the first one's grid, which all share (same_grid.hpp). A voxel that an earlier map
/// labels in any layer is that map's alone. Ids are numbered anew from 1 (u16), in the order of the maps and
/// of their ids, so that each means one thing; ids that no voxel has go. Labels of one name keep it, and
/// entries that name it mean both. Throws Error{data} where there are more than 65535. One map alone comes
/// back as it is.
Segmentation merged(std::vector<Segmentation> maps);

}  // namespace ecorche::io
