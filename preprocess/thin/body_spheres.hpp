// SPDX-License-Identifier: Apache-2.0
// A prepared body as balls, hung on its rig.
#pragma once

#include <ecorche/values/context.hpp>
#include <ecorche/values/skeleton.hpp>
#include <ecorche/values/volumetric_skeleton.hpp>

namespace ecorche::thin {

/// The skeleton `body` of all that is not 0 in `labels` (isotropic, u16, as `voxel::voxelize` makes it):
/// exact distances, one tree (components are joined by what lies between them), every voxel attached to a
/// segment of `rig`. Joints outside the body are told as a warning: the bones to them attract what sees them.
/// Throws Error{data} where `thinness` leaves no voxel.
VolumetricSkeleton body_spheres(const Image& labels, const Skeleton& rig, double thinness,
                                const Context& context);

}  // namespace ecorche::thin
