// SPDX-License-Identifier: Apache-2.0
// The model on disk: one HDF5 file that VTKHDF readers open.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::model_file {

inline constexpr int format_major = 1;
inline constexpr int format_minor = 6;

/// For the main of a program that reads others' models, before anything else of HDF5: after it has refused a
/// damaged file HDF5 1.10 cannot close itself (it complains, or crashes, as the process ends). Every file of
/// ours is closed anyway; what else uses HDF5 then closes its own.
void leave_hdf5_open_at_exit();

/// Writes `model` to a temporary name beside `path`, flushes it to the disk and renames it; on failure or a
/// stop nothing is left and an older file of that name stays whole. `path` must end in `.hdf` (ParaView asks
/// for it). Throws Error{usage, cannot_create, io, interrupted}.
void write(const Model& model, const std::filesystem::path& path, const Context& context);

/// Reads a model, trusting nothing: the guard first checks that every dataset is contiguous, unfiltered,
/// local, of the expected type and shape and inside its file; then digests, then invariants (indices in
/// range, rows sorted and summing to 1, positive tets, parents first). Throws Error{missing_input, data}; the
/// message names the dataset.
Model read(const std::filesystem::path& path, const Context& context);

/// XXH64 of every dataset, as stored and as found.
struct DigestCheck {
  std::string dataset;
  bool good = false;
};

/// Digests only, without stopping at the first bad one.
std::vector<DigestCheck> check_digests(const std::filesystem::path& path, const Context& context);

/// A dataset as it stands in a file.
struct DatasetSummary {
  std::string path;                  ///< absolute in the file
  std::string type;                  ///< u8, i32, f32, ..., text
  std::vector<std::uint64_t> shape;  ///< slowest first
  std::uint64_t bytes = 0;
};

/// Every dataset, sorted by path, after the guard's checks; nothing of their contents is read.
std::vector<DatasetSummary> list(const std::filesystem::path& path);

/// XXH64 over everything in the model but its provenance: two models with the same identity pose alike.
std::uint64_t identity(const Model& model);

/// XXH64 of the names, parents, kinds, centres, axes and sequences of the rig: what a pose is meant for.
std::uint64_t rig_digest(const Rig& rig);

/// XXH64 of names, counts and triangles of the tissues: what a mesh frame is meant for.
std::uint64_t topology_digest(const Model& model);

}  // namespace ecorche::model_file
