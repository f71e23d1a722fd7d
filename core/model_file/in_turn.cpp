// SPDX-License-Identifier: Apache-2.0
#include "core/model_file/in_turn.hpp"

#include <tbb/parallel_for.h>

#include <atomic>
#include <exception>

namespace ecorche::model_file {

void run_as_in_turn(const std::vector<std::function<void()>>& parts) {
  std::vector<std::exception_ptr> thrown(parts.size());
  std::atomic<std::size_t> first = parts.size();
  const auto run = [&](std::size_t p) {
    if (p > first) return;
    try {
      parts[p]();
    } catch (...) {
      thrown[p] = std::current_exception();
      std::size_t before = first;
      while (p < before && !first.compare_exchange_weak(before, p)) {
      }
    }
  };
  tbb::parallel_for(std::size_t{0}, parts.size(), run, tbb::simple_partitioner());
  if (first < parts.size()) std::rethrow_exception(thrown[first]);
}

}  // namespace ecorche::model_file
