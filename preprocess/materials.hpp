// SPDX-License-Identifier: Apache-2.0
// Which flesh is how stiff.
#pragma once

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::preprocess {

/// Nothing where the case gives no stiffness. Else every tet that is no bone's is of the innermost tissue
/// that gives one and holds the tet's centroid (check::Inside): the one of least volume, ties to the first of
/// the case; and of the case's flesh where none does. `model`: nodes, tets, labels and tissues. Warns of
/// tissues that no tet came to. Parallel over tets, the same for any number of threads.
Materials materials_of(const Case& patient, const Model& model, const Context& context);

}  // namespace ecorche::preprocess
