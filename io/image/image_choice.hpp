// SPDX-License-Identifier: Apache-2.0
// What to take of a file that can be read in several ways, or of a folder that holds several images.
#pragma once

#include <string>

#include "io/image/nifti_form.hpp"

namespace ecorche::io {

struct ImageChoice {
  NiftiForm form = NiftiForm::either;
  std::string series;  ///< of DICOM: UID, the end of one, or description; empty: the only one
  int phase = 0;       ///< of an image in time: which volume, from 1; 0: there is only one
};

}  // namespace ecorche::io
