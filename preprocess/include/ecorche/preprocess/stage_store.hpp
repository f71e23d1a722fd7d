// SPDX-License-Identifier: Apache-2.0
// Where a run keeps what its stages made, so that another run need not make it again.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace ecorche::preprocess {

/// Bytes by name, kept by whoever runs the pipeline (the app: a folder). A store may forget, and may lose or
/// damage what it keeps only where it can tell: `find` returns exactly what `keep` was given, or nothing.
class StageStore {
 public:
  virtual ~StageStore() = default;

  /// XXH64 of the program that makes the stages: another build keeps its own.
  virtual std::uint64_t program() const = 0;
  /// What was kept under that name, if anything.
  virtual std::optional<std::string> find(std::string_view name) = 0;
  /// Throws Error where that fails; the run then goes on without.
  virtual void keep(std::string_view name, std::string_view bytes) = 0;
};

}  // namespace ecorche::preprocess
