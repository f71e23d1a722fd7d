// SPDX-License-Identifier: Apache-2.0
// A body of a few hundred tets that no stage made: for tests that need a Model and nothing before it.
#pragma once

#include <ecorche/values/model.hpp>

namespace ecorche::test {

/// A square beam, 40 x 40 x 300 mm along z, in three segments (`base`, `middle` on a hinge at z = 100, `tip`
/// on a ball at z = 200): 432 tets, a skin whose vertices stand up to 1 mm outside the mesh, a bone in each
/// segment, one tissue, a 16-bit CT and an 8-bit label map of 10 mm voxels. Weights blend linearly over 40 mm
/// about each joint.
Model toy_model();

/// The same with a correction of its hinge (3 samples, as many modes) and of its ball (5 samples, 2 modes)
/// that nobody measured, of every second free node each, one of a whole pose of both, and a safe range; every
/// third tet, where it is soft, is of the tissue and four times as stiff.
Model corrected_toy_model();

/// The same, its CT sampled so many times as finely along each axis: several bricks from 5 on.
Model fine_toy_model(int times);

}  // namespace ecorche::test
