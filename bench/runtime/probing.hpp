// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include <ecorche/values/model.hpp>
#include "bench/runtime/figure.hpp"

namespace ecorche::bench {

/// Times of both ways through the body posed as `nodes`: 10 000 points spread over it, and one.
void time_probe(const Table& table, const std::shared_ptr<const Model>& model, std::span<const float> nodes,
                int threads);

}  // namespace ecorche::bench
