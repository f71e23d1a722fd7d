// SPDX-License-Identifier: Apache-2.0
// What a served model has in memory as other servers of this machine do: kept once for all of them.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <ecorche/runtime/held_arrays.hpp>
#include <ecorche/values/model.hpp>
#include "core/files/page_store.hpp"

namespace ecorche::server {

/// The large arrays of a model: tets, weights, tissues, volumes, spheres, corrections.
runtime::HeldArrays arrays_of(const Model& model);

class SharedArrays {
 public:
  /// Without a store nothing is shared. `model`: its name, for the log.
  SharedArrays(std::shared_ptr<const files::PageStore> store, std::string model)
      : store_(std::move(store)), model_(std::move(model)) {}

  /// For as long as this lives; `what`, for the log. The log says why where it cannot be. From any thread;
  /// others may read the arrays meanwhile.
  void add(const char* what, const runtime::HeldArrays& arrays) noexcept;
  /// Whether anything would come of it.
  bool wanted() const { return store_ != nullptr; }

 private:
  std::shared_ptr<const files::PageStore> store_;
  std::string model_;
  std::mutex mutex_;
  std::vector<files::PageStore::Copy> copies_;
};

}  // namespace ecorche::server
