// SPDX-License-Identifier: Apache-2.0
#include "bench/runtime/figure.hpp"

#include <algorithm>
#include <chrono>
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

Table table_of_times() {
  return Table({{"what", 48},
                {"threads"},
                {"median ms", 9},
                {"best", 9},
                {"worst", 9},
                {"memory ms", 9},
                {"arithmetic ms", 9},
                {"walk ms", 9},
                {"over the larger"},
                {"plain Eigen"}});
}

void line(const Table& table, const std::string& what, int threads, const Figure& figure,
          const Floors& floors, double against) {
  const auto known = [](double value, int digits) { return value > 0 ? fixed(value, digits) : ""; };
  table.row({what, std::to_string(threads), fixed(figure.median, 3), fixed(figure.best, 3),
             fixed(figure.worst, 3), known(floors.memory, 3), known(floors.arithmetic, 3),
             known(floors.walk, 3), known(floors.larger() > 0 ? figure.median / floors.larger() : 0, 2),
             against > 0 ? fixed(against / figure.median, 1) + " x" : ""});
}

}  // namespace ecorche::bench
