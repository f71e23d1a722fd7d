// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/self_intersections.hpp"

namespace ecorche::check {

std::optional<Offenders> self_intersections([[maybe_unused]] const SurfaceMesh& mesh,
                                            [[maybe_unused]] const Context& context) {
#ifdef ECORCHE_GPL
  return cgal::self_intersections(mesh, context);
#else
  return std::nullopt;
#endif
}

}  // namespace ecorche::check
