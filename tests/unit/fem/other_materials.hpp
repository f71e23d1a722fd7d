// SPDX-License-Identifier: Apache-2.0
// Materials that another program has, to compare with.
#pragma once

#include <cmath>

#include "preprocess/fem/material.hpp"

namespace ecorche::fem {

/// CalculiX' *ELASTIC under NLGEOM (Saint Venant-Kirchhoff): mu |E|^2 + lambda/2 tr(E)^2, E = (F'F - I) / 2.
class SaintVenantKirchhoff final : public Material {
 public:
  explicit SaintVenantKirchhoff(const Lame& given) : lame_(given) {}
  std::string_view name() const override { return "saint_venant_kirchhoff"; }
  double bulk() const override { return 0; }
  Stretched at(const Eigen::Vector3d& s) const override {
    const Eigen::Vector3d e = (s.array().square() - 1) / 2;
    const double mu = lame_.mu, lambda = lame_.lambda, trace = e.sum();
    Stretched out;
    out.energy = mu * e.squaredNorm() + lambda / 2 * trace * trace;
    out.stress = s.array() * (2 * mu * e.array() + lambda * trace);
    out.curvature = lambda * s * s.transpose();
    for (Eigen::Index i = 0; i < 3; ++i) {
      const double a = s[(i + 1) % 3], b = s[(i + 2) % 3];
      out.curvature(i, i) += 2 * mu * e[i] + lambda * trace + 2 * mu * s[i] * s[i];
      out.twist[i] = lambda * trace + mu * (a * a - a * b + b * b - 1);
      out.flip[i] = lambda * trace + mu * (a * a + a * b + b * b - 1);
    }
    return out;
  }

 private:
  Lame lame_;
};

/// CalculiX' *HYPERELASTIC, NEO HOOKE: C10 (J^(-2/3) |F|^2 - 3) + 1/D1 (J - 1)^2, with C10 = mu/2 and D1 =
/// 2/K.
class NeoHooke final : public Material {
 public:
  explicit NeoHooke(const Lame& given) : c10_(given.mu / 2), bulk_(given.lambda + 2.0 / 3.0 * given.mu) {}
  std::string_view name() const override { return "neo_hooke"; }
  double bulk() const override { return bulk_; }
  double c10() const { return c10_; }
  Stretched at(const Eigen::Vector3d& s) const override {
    const double i = s.squaredNorm(), j = s.prod(), scale = c10_ / std::cbrt(j * j);
    Stretched out;
    out.energy = scale * i - 3 * c10_;
    const Eigen::Vector3d over = s.cwiseInverse();
    out.stress = scale * (2 * s - 2.0 / 3.0 * i * over);
    out.curvature = scale * (4.0 / 9.0 * i * over * over.transpose() - 4.0 / 3.0 * s * over.transpose() -
                             4.0 / 3.0 * over * s.transpose());
    for (Eigen::Index k = 0; k < 3; ++k) {
      out.curvature(k, k) += scale * (2 + 2.0 / 3.0 * i * over[k] * over[k]);
      const double of_pair = 2.0 / 3.0 * i * s[k] / j;
      out.twist[k] = scale * (2 - of_pair);
      out.flip[k] = scale * (2 + of_pair);
    }
    return out;
  }

 private:
  double c10_, bulk_;
};

}  // namespace ecorche::fem
