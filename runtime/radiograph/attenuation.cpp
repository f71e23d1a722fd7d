// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/attenuation.hpp>

#include <algorithm>
#include <array>
#include <cmath>

#include <ecorche/values/error.hpp>
#include "core/values/text.hpp"

namespace ecorche::runtime {
namespace {

// HubbellSeltzer95, table 4: mass attenuation coefficients with coherent scattering, cm^2/g.
struct Row {
  double kev, water, cortical_bone;  // liquid water; cortical bone of ICRU report 44
};
constexpr std::array<Row, 8> kTable{{{20, 0.8096, 4.001},
                                     {30, 0.3756, 1.331},
                                     {40, 0.2683, 0.6655},
                                     {50, 0.2269, 0.4242},
                                     {60, 0.2059, 0.3148},
                                     {80, 0.1837, 0.2229},
                                     {100, 0.1707, 0.1855},
                                     {150, 0.1505, 0.1480}}};
constexpr double kWaterDensity = 1.0, kBoneDensity = 1.92;  // g/cm^3, its table 2
constexpr double kScannerKev = 70;                          // of 120 kV, filtered

struct Coefficients {
  double water, bone;  // 1/mm
};

Coefficients at(double kev) {
  const auto above =
      std::find_if(kTable.begin() + 1, kTable.end() - 1, [&](const Row& row) { return row.kev >= kev; });
  const Row &low = *(above - 1), &high = *above;
  const double share = std::log(kev / low.kev) / std::log(high.kev / low.kev);
  const auto between = [&](double a, double b) { return a * std::pow(b / a, share); };
  return {between(low.water, high.water) * kWaterDensity / 10,
          between(low.cortical_bone, high.cortical_bone) * kBoneDensity / 10};
}

}  // namespace

double cortical_bone_hu() {
  const Coefficients scanner = at(kScannerKev);
  return 1000 * (scanner.bone / scanner.water - 1);
}

Attenuation::Attenuation(double kev) : kev_(kev), water_(0), per_bone_hu_(0) {
  if (!(kev >= least_kev && kev <= most_kev)) {
    throw Error(ErrorKind::usage, "energy", text::number(kev, 6) + " keV",
                "from " + text::number(least_kev) + " to " + text::number(most_kev) +
                    " keV; a tube's effective energy is about half of its peak voltage");
  }
  const Coefficients here = at(kev);
  water_ = here.water;
  per_bone_hu_ = (here.bone - here.water) / cortical_bone_hu();
}

double Attenuation::cortical_bone() const {
  return of_hu(cortical_bone_hu());
}

double nominal_hu(Group group, std::string_view name) {
  if (group == Group::organ && name.starts_with("lung")) return -750;
  if (group == Group::organ && name.starts_with("trachea")) return -1000;
  switch (group) {
    case Group::bone:
      return 700;  // cortex and marrow together
    case Group::cartilage:
      return 100;
    case Group::ligament:
      return 80;
    case Group::muscle:
      return 50;
    case Group::fat:
      return -100;
    case Group::skin:  // the body around all others
    case Group::organ:
    case Group::vessel:
    case Group::nerve:
    case Group::other:
      break;
  }
  return 40;
}

}  // namespace ecorche::runtime
