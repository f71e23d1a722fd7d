// SPDX-License-Identifier: Apache-2.0
// The built-in synthetic patient: every surface, volume, joint and motion from formulas.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/pose.hpp>

namespace ecorche::phantom {

enum class Size : std::uint8_t {
  small,     ///< under 10 000 tissue vertices in all: tests
  standard,  ///< about 150 000: the demo
  paper,     ///< at least 1.28 M tissue vertices, image near 250 x 120 x 700: Sujar18's largest model
};

struct Phantom {
  Case patient;             ///< as it would be scanned: its joints are rules or given centres
  Skeleton truth;           ///< the same skeleton with every true centre and axis given
  std::vector<Clip> clips;  ///< `walk` and `bend`, at 30 frames per second, at least 2 s, looping
};

/// How far bodies of different seeds differ.
enum class Variety : std::uint8_t {
  plain,       ///< by a few centimetres
  population,  ///< as people do: height, limbs, fat; some lack an organ or a bone
};

/// Same arguments, same bytes. `seed` draws the noise of the CT and the body, as `variety` says; `voxel_mm`
/// is the edge of the scan's voxels, 0: as the size has them (6, 4 or 2.5).
Phantom make(Size size, std::uint64_t seed, const Context& context, double voxel_mm = 0,
             Variety variety = Variety::plain);

/// The bar of Sujar18 figure 7: four bones in a row in a square bar, three joints.
Phantom make_bar(Size size, const Context& context);

}  // namespace ecorche::phantom
