// SPDX-License-Identifier: Apache-2.0
// A part of a posed volume at its full resolution, through the server.
#pragma once

#include <ecorche/v1/stream.pb.h>
#include "bench/server/served.hpp"

namespace ecorche::bench {

struct RegionRate {
  double per_second = 0;
  double p50_ms = 0, p99_ms = 0;        ///< from a pose's sending to its whole frame's arrival
  double posed_ms = 0, encoded_ms = 0;  ///< in the server, p50; refilling belongs to encoding
  double held = 0;                      ///< voxels of the region that were not background, on average
  double cpu_ms = 0;                    ///< of the server, a frame: all its threads together
};

/// The model's first volume, `edge` cubed voxels around its middle, of a body that walks as Walker's do, for
/// so many seconds: the next pose goes out when a frame has come. Throws Error as the client.
RegionRate region_rate(const Served& served, v1::Deformer deformer, int edge, double seconds);

}  // namespace ecorche::bench
