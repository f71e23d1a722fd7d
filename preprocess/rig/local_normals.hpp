// SPDX-License-Identifier: Apache-2.0
// Normals of a surface whose vertices are noisy.
#pragma once

#include "preprocess/rig/surface_points.hpp"

namespace ecorche::rig {

/// #P by 3, unit: the points' own normals where these agree with their neighbours' (median angle to the mean
/// of the ten nearest below 30 degrees); else those of the planes through each point's ten nearest, on the
/// side of their mean normal: vertices 1 mm off at edges of 3 mm turn triangles by 30 degrees, and a vertex
/// that is far off spoils all its neighbours' normals. Of more than a few thousand points, ask for a part.
Points local_normals(const SurfacePoints& points);

}  // namespace ecorche::rig
