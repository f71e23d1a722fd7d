// SPDX-License-Identifier: Apache-2.0
// A time, and the table of times.
#pragma once

#include <algorithm>
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

/// What no version of the work can be faster than, ms; 0 where it is not known.
struct Floors {
  double memory = 0;      // its bytes over the bandwidth
  double arithmetic = 0;  // the same kernels on data in the first cache
  double walk = 0;        // its bytes read and written as the kernels do, without their arithmetic

  double larger() const { return std::max(memory, arithmetic); }
};

/// One row; `against` is the time of plain Eigen, where it is known.
void line(const Table& table, const std::string& what, int threads, const Figure& figure,
          const Floors& floors = {}, double against = 0);

}  // namespace ecorche::bench
