// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "io/surface/surface_file.hpp"

namespace ecorche::io::vtu {

/// VTK XML UnstructuredGrid of tets alone, of one or several pieces, stored as vtp.hpp says. Arrays over the
/// points come along where every piece has them. Throws Error{data}, also for a cell that is no tet and for a
/// coordinate or value that is not finite.
TetFile decode(std::string_view file, const std::string& where, const files::ReadLimits& limits = {});

}  // namespace ecorche::io::vtu
