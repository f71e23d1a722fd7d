// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <ecorche/values/error.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// Refuses a model whose parts do not belong together.
[[noreturn]] inline void unfit(const Model& model, const std::string& what) {
  throw Error(ErrorKind::data, "model " + model.name, what, "preprocess the case again");
}

}  // namespace ecorche::runtime
