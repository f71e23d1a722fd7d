// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ecorche/files/budget.hpp>
#include <ecorche/values/image.hpp>
#include "io/image/dicom_stack.hpp"

namespace ecorche::io::dicom {

/// Slices of a tilted gantry or at uneven distances, on the grid of `stack`: within a slice bilinear, between
/// slices linear. Outside of all slices stands the padding that the file names, else the least value.
Image resampled(const Image& slices, const PlacedStack& stack, files::Budget& budget);

}  // namespace ecorche::io::dicom
