// SPDX-License-Identifier: Apache-2.0
#include "runtime/quality/tissue_limits.hpp"

namespace ecorche::runtime {

// Tissue is mostly water: what moves it keeps its volume, and skinning that does not is wrong by all of the
// difference. What a limit grants is what the same tissue is measured to vary by, rounded up.
const std::array<TissueLimit, group_count>& tissue_limits() {
  static constexpr std::array<TissueLimit, group_count> limits{{
      {Group::skin, 0.10,
       "it encloses the body: a full breath is a vital capacity of 4 to 5 litres of 70, 7 %, and a body lies "
       "7.5 +- 5.7 % of that lower than it stands (doi:10.1016/0007-0971(85)90047-6)"},
      {Group::bone, 0.001,
       "rigid here; living bone is strained by up to 0.002 along one axis and gives way across it, about 0.1 "
       "% of its volume (Burr et al. 1996, Bone 18:405)"},
      {Group::muscle, 0.10,
       "keeps its volume, passive or working (Kinugasa et al. 2011, doi:10.1152/japplphysiol.00666.2011); "
       "drawn again from one scan hip muscles differ by 2 to 6 % (doi:10.1007/s10278-022-00700-1)"},
      {Group::organ, 0.10,
       "liver and spleen are smaller upright than supine (Nakagawa et al. 2025, "
       "doi:10.1007/s12194-024-00870-2), the lungs' vital capacity is 7.5 +- 5.7 % less supine "
       "(doi:10.1016/0007-0971(85)90047-6); what fills or empties is not the pose"},
      {Group::vessel, 0.15,
       "raising the legs fills the vena cava's section from 386 to 449 mm2, 16 %; the aorta's is the same "
       "lying and standing (doi:10.1177/0284185120950112)"},
      {Group::nerve, 0.10, "as muscle: it is mostly water; stretched nerves thin"},
      {Group::cartilage, 0.10,
       "hopping presses 5 % out of the tibia's, 8 % at the worst place (Sutter et al. 2015, PMC4315145)"},
      {Group::ligament, 0.10,
       "as muscle; it loses some water when stretched, which no pose here does for long"},
      {Group::fat, 0.10, "behaves as incompressible (Mihai et al. 2015, J. R. Soc. Interface 12:20150486)"},
      {Group::other, 0.10, "as most tissues"},
  }};
  return limits;
}

double tissue_limit(Group group) {
  return tissue_limits().at(static_cast<std::size_t>(group)).max_volume_change;
}

}  // namespace ecorche::runtime
