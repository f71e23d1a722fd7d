// SPDX-License-Identifier: Apache-2.0
#include "preprocess/fem/material.hpp"

#include <cmath>
#include <string>

#include <ecorche/values/error.hpp>
#include "preprocess/fem/isotropic.hpp"

namespace ecorche::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The products of the two stretches that are not i: dJ / ds_i.
Vector3d cofactors(const Vector3d& s) {
  return {s[1] * s[2], s[2] * s[0], s[0] * s[1]};
}

class StableNeoHookean final : public Material {
 public:
  explicit StableNeoHookean(const Lame& given) : lame_(given), of_(given) {}
  std::string_view name() const override { return "stable_neo_hookean"; }
  double bulk() const override { return of_.bulk(); }
  std::optional<Lame> settles_by() const override { return lame_; }

  Stretched at(const Vector3d& s) const override {
    const double i = s.squaredNorm(), j = s.prod();
    // |F|^2 - 3 without the rounding of a sum near 3.
    const double over = (s.array() - 1).square().sum() + 2 * (s.array() - 1).sum();
    const double pull = of_.pull(i);
    Stretched out;
    out.energy = of_.density(over, j);
    out.stress = pull * s;
    out.curvature = pull * Matrix3d::Identity() + of_.pull_slope(i) * s * s.transpose();
    out.twist.setConstant(pull);
    out.flip.setConstant(pull);
    add_volume(s, of_.pressure(j), of_.stiffness(j), out);
    return out;
  }
  double energy(const Matrix3d& F) const override {
    return of_.density(F.squaredNorm() - 3, F.determinant());
  }

 private:
  Lame lame_;
  elastic::StableNeoHookean of_;
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
  return elastic::lame(poisson);
}

double Material::energy(const Matrix3d& F) const {
  return at(principal(F).s).energy;
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
