// SPDX-License-Identifier: Apache-2.0
// Optimised centres of rotation of the nodes (LeHodgins16 eq. 1; Sujar18 eqs. 6-7).
#pragma once

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::cor {

struct Options {
  double sigma = 0.05;  ///< 0 < sigma < 0.1
};

/// For node p with weights w_p, and tet t with volume V_t, centroid c_t and mean node weights w_t:
///   s(p, t) = sum over j != k of w_pj w_pk w_tj w_tk exp(-(w_pj w_tk - w_pk w_tj)^2 / sigma^2),
///   centre  = sum_t s V_t c_t / sum_t s V_t.
/// The sum decouples by pair of segments: per live pair a histogram of tets over (w_j, w_k), a kernel table
/// from it, and one interpolated look-up per node and pair. Worst error 1e-4 of body height against the sum
/// over all tets. A node whose denominator vanishes (one segment only, or nothing alike) has no centre.
/// Throws Error{usage} for a sigma out of range.
CorCentres centres(const PointsF& nodes, const Tets& tets, const Weights& weights, std::size_t segments,
                   const Options& options, const Context& context);

}  // namespace ecorche::cor
