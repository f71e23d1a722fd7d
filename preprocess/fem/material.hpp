// SPDX-License-Identifier: Apache-2.0
// What flesh costs to deform: energy densities of isotropic materials as functions of the principal
// stretches.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "core/elastic/stable_neo_hookean.hpp"

namespace ecorche::fem {

using elastic::Lame;
/// `poisson` in [0, 0.5). Throws Error{usage} elsewhere.
Lame lame(double poisson);

/// A density and its derivatives at the stretches s, where F = U diag(s) V' with rotations U, V: the last
/// stretch is negative where F turns a tet inside out.
struct Stretched {
  double energy = 0;
  Eigen::Vector3d stress;     ///< d energy / d s_i
  Eigen::Matrix3d curvature;  ///< d^2 energy / d s_i d s_j
  /// Of the pair (i, j) that is not k: (stress_i + stress_j) / (s_i + s_j), and with minus signs. Closed
  /// forms, since both are 0 / 0 at places that every body passes through.
  Eigen::Vector3d twist, flip;
};

/// Energy density at(s) + bulk() / 2 (J - 1)^2, J = s_0 s_1 s_2. The second term is kept apart so that an
/// element may take it at its mean dilatation.
class Material {
 public:
  virtual ~Material() = default;
  virtual std::string_view name() const = 0;
  virtual double bulk() const = 0;
  virtual Stretched at(const Eigen::Vector3d& s) const = 0;
  /// Lame's constants, of the material that elastic::Settler knows.
  virtual std::optional<Lame> settles_by() const { return std::nullopt; }
  /// at(s).energy of the stretches of F, without them where the material can.
  virtual double energy(const Eigen::Matrix3d& F) const;
};

/// Adds pressure (J - 1) + modulus / 2 (J - J_0)^2 at J_0 = J (so its first derivative is the pressure's
/// alone).
void add_volume(const Eigen::Vector3d& s, double pressure, double modulus, Stretched& out);

/// `stable_neo_hookean` (elastic::StableNeoHookean), or `corotational`:
/// Sujar18's and Mueller04's co-rotational linear material with exact rotations, which softens under
/// compression and does not resist inversion: past 90 degrees its iterations find no end.
std::unique_ptr<Material> make_material(std::string_view name, double poisson);
std::vector<std::string_view> material_names();

}  // namespace ecorche::fem
