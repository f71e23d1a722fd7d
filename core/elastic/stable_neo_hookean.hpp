// SPDX-License-Identifier: Apache-2.0
// What flesh costs to deform: Smith18's stable neo-Hookean energy, with a wall before flat tets.
#pragma once

#include <cmath>

namespace ecorche::elastic {

/// Lame's constants, in units of Young's modulus. Where all that moves a body is prescribed, only the ratio
/// of such moduli shapes it, so it is 1 here; flesh that is stiffer than other flesh weighs more in the sum.
struct Lame {
  double mu = 0, lambda = 0;
};
/// `poisson` in [0, 0.5).
constexpr Lame lame(double poisson) {
  return {1 / (2 * (1 + poisson)), poisson / ((1 + poisson) * (1 - 2 * poisson))};
}

/// Of a deformation gradient F, by I = |F|^2 and J = det F: density(I - 3, J) + bulk() / 2 (J - 1)^2 a volume
/// of rest. The second term is kept apart so that an element may take it at its mean dilatation.
///
/// Smith18 eq. 14 with Lame's constants as of its section 3.4 is mu/2 (I - 3) - mu/2 log((I + 1) / 4) +
/// lambda/2 (J - alpha)^2, alpha = 1 + 3/4 mu/lambda, less its value at rest. Of its lambda, Lame's own is
/// left to bulk(); expanded about J = 1 the rest is -3/4 mu (J - 1) + 5/6 mu_Lame / 2 (J - 1)^2.
///
/// That energy has a low price for a flat tet, and hardly a higher one for an inverted one: a node that
/// several bones draw comes to rest beyond the far side of its tet. So below J = kCrushed a wall is added,
/// with two continuous derivatives; above, every bit is Smith18's. Flesh that lost so much of its volume is
/// beyond what any of this knows, but it lies on the side where flesh is.
class StableNeoHookean {
 public:
  static constexpr double kCrushed = 0.3;

  explicit constexpr StableNeoHookean(const Lame& given)
      : mu_(4.0 / 3.0 * given.mu), own_(5.0 / 6.0 * given.mu), bulk_(given.lambda) {}

  double bulk() const { return bulk_; }
  /// `over`: I - 3.
  double density(double over, double j) const {
    const double u = beyond(j);
    return mu_ / 2 * (over - std::log1p(over / 4)) - 0.75 * mu_ * (j - 1) + own_ / 2 * (j - 1) * (j - 1) +
           kWall * kCrushed / 3 * u * u * u;
  }
  /// d density / dF = pull(I) F + pressure(J) dJ/dF; pull_slope is twice d pull / dI, stiffness d pressure /
  /// dJ.
  double pull(double i) const { return mu_ * i / (i + 1); }
  double pull_slope(double i) const { return 2 * mu_ / ((i + 1) * (i + 1)); }
  double pressure(double j) const {
    const double u = beyond(j);
    return own_ * (j - 1) - 0.75 * mu_ - kWall * u * u;
  }
  double stiffness(double j) const { return own_ + 2 * kWall / kCrushed * beyond(j); }

 private:
  static constexpr double kWall = 15;  // pressure at J = 0, in Young's moduli

  static double beyond(double j) { return j < kCrushed ? 1 - j / kCrushed : 0; }

  double mu_, own_, bulk_;
};

}  // namespace ecorche::elastic
