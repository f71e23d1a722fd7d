// SPDX-License-Identifier: Apache-2.0
// What a server is given to serve.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <ecorche/values/model.hpp>
#include "runtime/server/session/clip.hpp"

namespace ecorche::server {

/// A model, and the motion that can be played on it.
struct ModelParts {
  std::shared_ptr<const Model> model;
  std::vector<Clip> clips = {};
};

struct NamedModel {
  std::string name;
  std::shared_ptr<const Model> model;
  std::vector<Clip> clips = {};
  /// For ReloadModel, on a worker; throws Error. Empty: cannot be reloaded.
  std::function<ModelParts()> read_again = {};
};

}  // namespace ecorche::server
