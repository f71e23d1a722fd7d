// SPDX-License-Identifier: Apache-2.0
// Why a skin encloses less than the body.
#pragma once

#include <optional>
#include <string>

#include <ecorche/values/mesh.hpp>

namespace ecorche::check {

/// What a surface has that keeps its inside from being one, and what mends it.
struct SkinFault {
  std::string what, mend;
};

/// Holes, else no volume, else closed parts within others that are turned inward (the inner side of a skin
/// that was made a shell); nothing where it has none of these. O(#F log #F).
std::optional<SkinFault> skin_fault(const SurfaceMesh& skin);

}  // namespace ecorche::check
