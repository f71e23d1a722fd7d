// SPDX-License-Identifier: Apache-2.0
// The folder of one posed body: it appears whole, with its pose and a manifest, or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/values/pose.hpp>
#include "app/posed_manifest.hpp"
#include "core/files/staged_folder.hpp"

namespace ecorche::app {

/// What is said of the body in its manifest.
struct PosedAs {
  std::uint64_t identity = 0;  ///< of the model
  std::string skinning, deformer;
  bool unfolded = false, settled = false;
  bool field = false;  ///< whether the displacement field was written
};

class PosedFolder {
 public:
  /// An earlier posed body in `target` gives way as a whole; anything else there is Error{cannot_create}.
  explicit PosedFolder(const std::filesystem::path& target);

  /// Where to write meanwhile.
  const std::filesystem::path& stage() const { return staged_.stage(); }

  /// Adds the pose as it was asked for, the scan's surfaces (where the tets were written, and some tissues)
  /// and the manifest of all that lies in the stage; then the stage stands under `target`. The names added.
  std::vector<std::string> finish(const Model& model, const runtime::PosedBody& body, const Pose& asked,
                                  const PosedAs& as, const Context& context);

 private:
  files::StagedFolder staged_;
  std::vector<std::filesystem::path> old_;
};

/// Refuses a folder that no posed body can be written to. Throws Error{cannot_create}.
void check_folder_of_a_body(const std::filesystem::path& folder);
/// Refuses a folder of frames that is itself a posed body. Throws Error{cannot_create}.
void check_folder_of_frames(const std::filesystem::path& folder);

}  // namespace ecorche::app
