// SPDX-License-Identifier: Apache-2.0
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>

/// The nodes of a prepared body; 0 where it cannot be read.
extern "C" __attribute__((visibility("default"))) int plugin_nodes(const char* path) try {
  const auto model = std::make_shared<const ecorche::Model>(ecorche::model_file::read(path, {}));
  const ecorche::runtime::BodyPoser poser(model);
  return static_cast<int>(poser.model().nodes.rows());
} catch (...) {
  return 0;
}
