// SPDX-License-Identifier: Apache-2.0
// The vertices of a frame as clients draw them; the instruction set is chosen at run time.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace ecorche::wire::kernels {

/// On the calling thread; allocates nothing. `numbers`: 3 per vertex; out[i] = low[i % 3] + step *
/// numbers[i], in double precision, rounded once. `out` is as long.
void to_positions(std::span<const std::uint16_t> numbers, const std::array<double, 3>& low, double step,
                  std::span<float> out);

/// On the calling thread; allocates nothing. `packed`: 2 per vertex; `out`: from_oct16() of each, 3 per
/// vertex.
void to_normals(std::span<const std::int8_t> packed, std::span<float> out);

}  // namespace ecorche::wire::kernels
