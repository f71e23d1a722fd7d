// SPDX-License-Identifier: Apache-2.0
#include "bench/runtime/bandwidth.hpp"

#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <vector>

namespace ecorche::bench {

double bandwidth(double mib) {
  const auto count = static_cast<std::size_t>(mib * (1 << 20) / (3 * sizeof(float)));
  std::vector<float> a(count, 1), b(count, 2), sum(count, 0);
  double best = 0;
  for (int trial = 0; trial < 10; ++trial) {
    const auto start = std::chrono::steady_clock::now();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 1 << 16), [&](const auto& range) {
      const float *x = a.data(), *y = b.data();
      float* out = sum.data();
      for (std::size_t i = range.begin(); i < range.end(); ++i) out[i] = x[i] + y[i];
    });
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
    best = std::max(best, static_cast<double>(3 * sizeof(float) * count) / time.count() / 1e9);
  }
  return best;
}

double last_cache() {
#ifdef _SC_LEVEL3_CACHE_SIZE
  const long bytes = sysconf(_SC_LEVEL3_CACHE_SIZE);
  if (bytes > 0) return static_cast<double>(bytes);
#endif
  return 32.0 * (1 << 20);
}

}  // namespace ecorche::bench
