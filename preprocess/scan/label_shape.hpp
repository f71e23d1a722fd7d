// SPDX-License-Identifier: Apache-2.0
// How long and how slender labels and bones are: a vertebra that lies where a raised arm would be is no
// humerus.
#pragma once

#include <vector>

#include "preprocess/scan/body_template.hpp"
#include "preprocess/scan/nameless.hpp"

namespace ecorche::scan {

/// Along the principal axes of points, mm.
struct Extents {
  double length = 0, width = 0;
};
Extents extents_of(const Points& points);

/// Which labels are far too short for which long bones of a template. Labels at the border of the field of
/// view are of any: the rest of them may lie beyond.
class TooShort {
 public:
  TooShort(const BodyTemplate& body, const std::vector<NamelessLabel>& labels, const ImageGrid& whole);

  /// `scale`: the size of the patient over the template's.
  bool operator()(std::size_t label, int bone, double scale) const {
    return label_[label] < kLeastLength * scale * bone_[static_cast<std::size_t>(bone)];
  }

  static constexpr double kLeastLength = 0.4;  ///< of a long bone's: epiphyses and halves are named apart

 private:
  std::vector<double> label_;  // length, mm; that of no bone at the border
  std::vector<double> bone_;   // of long ones, else 0
};

/// What holds the outside of all that is labelled becomes the body, or its shell, in `out`.
void find_bodies(const std::vector<NamelessLabel>& labels, std::vector<LabelMeaning>& out);

/// About `most` points of the labels of rows `which`, evenly.
Points points_of(const std::vector<NamelessLabel>& labels, const std::vector<std::size_t>& which,
                 Eigen::Index most);

}  // namespace ecorche::scan
