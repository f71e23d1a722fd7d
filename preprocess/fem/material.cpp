// SPDX-License-Identifier: Apache-2.0
#include "preprocess/fem/material.hpp"

#include <cmath>
#include <string>

#include <ecorche/values/error.hpp>

namespace ecorche::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The products of the two stretches that are not i: dJ / ds_i.
Vector3d cofactors(const Vector3d& s) {
  return {s[1] * s[2], s[2] * s[0], s[0] * s[1]};
}

/// Smith18: mu/2 (I - 3) - mu/2 log((I + 1) / 4) + lambda/2 (J - alpha)^2 with I = |F|^2 and alpha = 1 + 3/4
/// mu/lambda, less its value at rest. Of its lambda, Lame's own is left to bulk(); expanded about J = 1 the
/// rest is -3/4 mu (J - 1) + 5/6 mu_Lame / 2 (J - 1)^2, and at rest at() alone is mu_Lame |strain|^2.
class StableNeoHookean final : public Material {
 public:
  explicit StableNeoHookean(const Lame& given)
      : mu_(4.0 / 3.0 * given.mu), own_(5.0 / 6.0 * given.mu), bulk_(given.lambda) {}
  std::string_view name() const override { return "stable_neo_hookean"; }
  double bulk() const override { return bulk_; }

  Stretched at(const Vector3d& s) const override {
    const double i = s.squaredNorm(), j = s.prod();
    // |F|^2 - 3 without the rounding of a sum near 3.
    const double over = (s.array() - 1).square().sum() + 2 * (s.array() - 1).sum();
    const double pull = mu_ * i / (i + 1);
    Stretched out;
    out.energy =
        mu_ / 2 * (over - std::log1p(over / 4)) - 0.75 * mu_ * (j - 1) + own_ / 2 * (j - 1) * (j - 1);
    out.stress = pull * s;
    out.curvature = pull * Matrix3d::Identity() + 2 * mu_ / ((i + 1) * (i + 1)) * s * s.transpose();
    out.twist.setConstant(pull);
    out.flip.setConstant(pull);
    add_volume(s, own_ * (j - 1) - 0.75 * mu_, own_, out);
    return out;
  }

 private:
  double mu_, own_, bulk_;
};

/// mu |S - I|^2 + lambda/2 tr(S - I)^2 with F = R S. Its volume term is no function of J, so bulk() is 0.
class Corotational final : public Material {
 public:
  explicit Corotational(const Lame& given) : lame_(given) {}
  std::string_view name() const override { return "corotational"; }
  double bulk() const override { return 0; }

  Stretched at(const Vector3d& s) const override {
    const Vector3d e = s.array() - 1;
    const double trace = e.sum(), mu = lame_.mu, lambda = lame_.lambda;
    Stretched out;
    out.energy = mu * e.squaredNorm() + lambda / 2 * trace * trace;
    out.stress = 2 * mu * e + Vector3d::Constant(lambda * trace);
    out.curvature = 2 * mu * Matrix3d::Identity() + Matrix3d::Constant(lambda);
    out.flip.setConstant(2 * mu);
    for (Eigen::Index k = 0; k < 3; ++k) {
      // Two stretches that cancel have no rotation of their own: the material's known flaw.
      const double sum = s.sum() - s[k];
      out.twist[k] =
          2 * mu + 2 * (lambda * trace - 2 * mu) / std::copysign(std::max(std::abs(sum), 1e-9), sum);
    }
    return out;
  }

 private:
  Lame lame_;
};

}  // namespace

Lame lame(double poisson) {
  if (!(poisson >= 0 && poisson < 0.5)) {
    throw Error(ErrorKind::usage, "--poisson", std::to_string(poisson) + " is not within 0 and 0.5",
                "flesh is nearly incompressible: 0.45 to 0.499");
  }
  return {1 / (2 * (1 + poisson)), poisson / ((1 + poisson) * (1 - 2 * poisson))};
}

void add_volume(const Vector3d& s, double pressure, double modulus, Stretched& out) {
  const Vector3d c = cofactors(s);
  out.stress += pressure * c;
  out.curvature += modulus * c * c.transpose();
  out.curvature += pressure * Matrix3d{{0, s[2], s[1]}, {s[2], 0, s[0]}, {s[1], s[0], 0}};
  out.twist += pressure * s;
  out.flip -= pressure * s;
}

std::vector<std::string_view> material_names() {
  return {"stable_neo_hookean", "corotational"};
}

std::unique_ptr<Material> make_material(std::string_view name, double poisson) {
  if (name == "stable_neo_hookean") return std::make_unique<StableNeoHookean>(lame(poisson));
  if (name == "corotational") return std::make_unique<Corotational>(lame(poisson));
  throw Error(ErrorKind::usage, "--material", "there is no material '" + std::string(name) + "'",
              "use stable_neo_hookean or corotational");
}

}  // namespace ecorche::fem
