// SPDX-License-Identifier: Apache-2.0
// The files of io/case/data as they are, in the program.
#pragma once

namespace ecorche::io::embedded {

extern const char* const poses;    ///< the pose library
extern const char* const opensim;  ///< the motion map of OpenSim's coordinates

extern const char* const structures;  ///< what labels of segmentations mean

// Skeleton templates.
extern const char* const human;
extern const char* const hand;
extern const char* const knee;
extern const char* const quadruped;

}  // namespace ecorche::io::embedded
