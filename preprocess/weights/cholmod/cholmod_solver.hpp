// SPDX-License-Identifier: AGPL-3.0-or-later
// Supernodal Cholesky by CHOLMOD (GPL): the solver of large bodies.
#pragma once

#include <memory>

#include "core/solve/spd_solver.hpp"

namespace ecorche::weights {

/// Double precision, supernodal, ordered by nested dissection (METIS; by AMD where it is not built in), BLAS
/// on one thread. About 1 GB of factor per 200 k unknowns of a tet mesh. Not to be shared between threads.
std::unique_ptr<solve::SpdSolver> make_cholmod_solver();

}  // namespace ecorche::weights
