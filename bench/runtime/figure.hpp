// SPDX-License-Identifier: Apache-2.0
// A time, and the table of times.
#pragma once

#include <functional>
#include <string>

#include "bench/table.hpp"

namespace ecorche::bench {

struct Figure {
  double median, best, worst;  // ms
};

/// `work` of frames 0, 1, ...: the first three are not counted.
Figure time(int frames, const std::function<void(int)>& work);

/// What line() adds to.
Table table_of_times();

/// One row; `floor_ms` and the time of plain Eigen, where they are known.
void line(const Table& table, const std::string& what, int threads, const Figure& figure, double floor_ms = 0,
          double against = 0);

}  // namespace ecorche::bench
