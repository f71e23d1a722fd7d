// SPDX-License-Identifier: Apache-2.0
// How strongly tissue attenuates X-rays of one energy.
#pragma once

#include <string_view>

#include <ecorche/values/case.hpp>

namespace ecorche::runtime {

/// From Hounsfield units to linear attenuation at one energy. Between air (-1000) and water (0) voxels are a
/// mixture of both, above water one of water and cortical bone, whose Hounsfield units are those of a scanner
/// with an effective energy of 70 keV (120 kV). Coefficients: HubbellSeltzer95, table 4, linear between the
/// logarithms of its rows.
class Attenuation {
 public:
  static constexpr double least_kev = 20, most_kev = 150, usual_kev = 60;

  /// Throws Error{usage} beyond those energies.
  explicit Attenuation(double kev = usual_kev);

  /// Of a voxel, 1/mm; 0 at -1000 and below, and for what is no number.
  double of_hu(double hu) const {
    if (!(hu > -1000)) return 0;
    return hu <= 0 ? water_ * (1 + hu / 1000) : water_ + hu * per_bone_hu_;
  }
  /// 1/mm.
  double water() const { return water_; }
  /// What a Hounsfield unit above water adds beyond what one below it takes away, 1/mm.
  double beyond_water() const { return per_bone_hu_ - water_ / 1000; }
  /// Of dense cortical bone, 1/mm.
  double cortical_bone() const;
  /// As given.
  double kev() const { return kev_; }

 private:
  double kev_, water_, per_bone_hu_;
};

/// The Hounsfield units of cortical bone where a scanner measures them.
double cortical_bone_hu();

/// What a tissue without a scan is taken for, Hounsfield units: by its group; lungs and windpipe, which are
/// organs full of air, by names that begin with `lung` or `trachea`.
double nominal_hu(Group group, std::string_view name);

}  // namespace ecorche::runtime
