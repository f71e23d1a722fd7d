// SPDX-License-Identifier: Apache-2.0
#include "bench/runtime/figure.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

namespace ecorche::bench {

Figure time(int frames, const std::function<void(int)>& work) {
  std::vector<double> ms;
  for (int f = -3; f < frames; ++f) {
    const auto start = std::chrono::steady_clock::now();
    work(f + 3);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    if (f >= 0) ms.push_back(took.count());
  }
  std::sort(ms.begin(), ms.end());
  return {ms[ms.size() / 2], ms.front(), ms.back()};
}

void line(const std::string& what, int threads, const Figure& figure, double floor_ms, double against) {
  std::printf("  %-38s %d thread%s %8.3f ms (%.3f .. %.3f)", what.c_str(), threads, threads == 1 ? " " : "s",
              figure.median, figure.best, figure.worst);
  if (floor_ms > 0) std::printf(", floor %7.3f, x%.2f", floor_ms, figure.median / floor_ms);
  if (against > 0) std::printf(", plain Eigen x%.1f slower", against / figure.median);
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace ecorche::bench
