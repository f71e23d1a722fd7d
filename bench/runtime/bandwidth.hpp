// SPDX-License-Identifier: Apache-2.0
// What memory gives: the floor under everything that a frame reads and writes.
#pragma once

namespace ecorche::bench {

/// GB/s of a kernel's traffic, two floats read for one written, on arrays of `mib` MiB in all, in the
/// caller's arena; the best of ten. Bytes that a store fetches first are not counted: a floor has no need of
/// them.
double bandwidth(double mib);

/// Bytes of the last cache, 32 MiB where the system does not say.
double last_cache();

}  // namespace ecorche::bench
