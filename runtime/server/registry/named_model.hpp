// SPDX-License-Identifier: Apache-2.0
// What a server is given to serve.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <ecorche/values/model.hpp>
#include "runtime/server/session/clip.hpp"
#include "runtime/server/session/skinning_data.hpp"

namespace ecorche::server {

/// A model, the motion that can be played on it, and poses by which the skinning of clients is measured.
struct ModelParts {
  std::shared_ptr<const Model> model;
  std::vector<Clip> clips = {};
  std::vector<NamedPose> poses = {};
};

struct NamedModel {
  std::string name;
  std::shared_ptr<const Model> model;
  std::vector<Clip> clips = {};
  /// For ReloadModel, on a worker; throws Error. Empty: cannot be reloaded.
  std::function<ModelParts()> read_again = {};
  std::vector<NamedPose> poses = {};
};

}  // namespace ecorche::server
