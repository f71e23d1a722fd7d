// SPDX-License-Identifier: Apache-2.0
// Which body a seed stands for.
#include <array>

#include "phantom/body.hpp"
#include "phantom/random.hpp"

namespace ecorche::phantom {
namespace {

// What people live without, and small bones that segmentations leave out. No joint of the skeleton is found
// on any of these.
constexpr std::array<const char*, 9> kMayMiss{"spleen",          "kidney_left",     "kidney_right",
                                              "patella_left",    "patella_right",   "toe_bones_left",
                                              "toe_bones_right", "hand_bones_left", "hand_bones_right"};

// Draws of the plain phantom have the indices 0 to 2: a varied one shares none with it.
enum class Draw : std::uint64_t { height = 16, leg, arm, fat, whether, which };

}  // namespace

Proportions plain_proportions(std::uint64_t seed) {
  Proportions of;
  of.leg = 1 - 0.025 * uniform(seed, 0);
  of.arm = 1 - 0.025 * uniform(seed, 1);
  of.fat = 5 + 3 * uniform(seed, 2);
  return of;
}

Proportions varied_proportions(std::uint64_t seed) {
  const auto between = [&](double low, double high, Draw draw) {
    return low + (high - low) * uniform(seed, static_cast<std::uint64_t>(draw));
  };
  Proportions of;
  of.height = between(0.88, 1.09, Draw::height);
  of.leg = between(0.93, 1.02, Draw::leg);
  of.arm = between(0.93, 1.02, Draw::arm);
  of.fat = between(4, 14, Draw::fat);
  // The first part with a chance of 1 / 4, and then a second one.
  const double chance = uniform(seed, static_cast<std::uint64_t>(Draw::whether));
  const std::uint64_t drawn = hash(seed, static_cast<std::uint64_t>(Draw::which));
  if (chance < 0.25) of.missing.emplace_back(kMayMiss[drawn % kMayMiss.size()]);
  if (chance < 0.0625)
    of.missing.emplace_back(kMayMiss[(drawn + 1 + (drawn >> 32) % (kMayMiss.size() - 1)) % kMayMiss.size()]);
  return of;
}

}  // namespace ecorche::phantom
