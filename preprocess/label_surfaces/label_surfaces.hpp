// SPDX-License-Identifier: Apache-2.0
// Surfaces of labels: closed meshes round the voxels of a label map.
#pragma once

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>

namespace ecorche::label_surfaces {

/// The surface of the voxels that `source` names in `labels`, LPS mm; no rows where there are none.
///
/// Closed, manifold, triangles counter-clockwise seen from outside, whatever the mask and the image's
/// direction (also left-handed) and also at the image's border. Every vertex lies within half a voxel, in
/// index space, of the boundary of the voxels. Smooth: Gibson 1998's constrained elastic surface nets, with
/// the low-pass filter of Taubin, Zhang and Golub 1996 for the elastic one, which would shrink the body.
/// Voxels that share an edge are joined, those that touch only by a corner are apart. Where two labels meet
/// face to face both have nearly the same surface.
SurfaceMesh extract(const CaseLabels& labels, const LabelSource& source, const Context& context);

/// Gives every entry of `patient` that has a source its surface, and forgets the source. Limbs are held apart
/// first where the labels say so (hold_apart.hpp); `apart` then keeps its gap and has no limbs. Where the
/// skin is the outside of everything, specks off the body belong to no entry, and a tissue that has nothing
/// else goes (strays.hpp). The same bytes for any number of threads. O(voxels + surface). Throws
/// Error{config}, naming the entry, for a source without voxels; Error{interrupted}.
void resolve(Case& patient, const Context& context);

}  // namespace ecorche::label_surfaces
