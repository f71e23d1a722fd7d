// SPDX-License-Identifier: Apache-2.0
// `preprocess --cache DIR`: stages kept as files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include <ecorche/preprocess/stage_store.hpp>

namespace ecorche::app {

/// One file a stage, `<name>.stage`: a magic, XXH64 of what follows, and the bytes; each appears whole or not
/// at all. What does not agree with its own digest is not there. After each `keep` the files used longest ago
/// go until the folder's stages are within the limit; other files in it are left alone. Two runs may share a
/// folder.
class StageFolder : public preprocess::StageStore {
 public:
  /// Makes the folder, and sweeps what killed runs left half written. Throws Error{cannot_create}.
  StageFolder(std::filesystem::path folder, double limit_gib);

  std::uint64_t program() const override { return program_; }
  std::optional<std::string> find(std::string_view name) override;
  void keep(std::string_view name, std::string_view bytes) override;

 private:
  std::filesystem::path path_of(std::string_view name) const;
  void make_room(std::uint64_t bytes);

  std::filesystem::path folder_;
  std::uint64_t limit_, program_;
};

}  // namespace ecorche::app
