// SPDX-License-Identifier: Apache-2.0
// Surfaces of a scan as one .vtp, with the tet that carries each vertex.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::io {

/// Surfaces one behind the other. A vertex that goes rigidly has tet -1 and shares of 0.
struct TiedSurfaces {
  PointsF V;                      ///< #V by 3, as scanned, LPS mm
  Triangles F;                    ///< #F by 3, rows of V
  std::vector<std::int32_t> tet;  ///< #V
  /// #V by 4, barycentric coordinates in that tet, signed outside of it.
  Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor> share;
};

/// XML PolyData with the point arrays `tet` and `share`, atomically. Throws Error{cannot_create}, Error{io}.
void write_tied_surfaces(const std::filesystem::path& path, const TiedSurfaces& surfaces);

/// Throws Error{missing_input}, and Error{data} for a file without those arrays, for a corner that is no
/// vertex, for a tet below -1, for a number that is not finite and for more than `limits` allow.
TiedSurfaces read_tied_surfaces(const std::filesystem::path& path, const files::ReadLimits& limits = {});

}  // namespace ecorche::io
