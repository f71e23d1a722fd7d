// SPDX-License-Identifier: Apache-2.0
// What a model file may hold before anything of it is read. HDF5 can point at any other file of the machine
// and can declare terabytes: here its structure is looked at, and only then does the reader believe an offset
// or a size.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/model_file/element_type.hpp"
#include "core/platform/file.hpp"

namespace ecorche::model_file {

/// A regular file, open for reading.
class InputFile {
 public:
  /// Throws Error{missing_input}.
  explicit InputFile(const std::filesystem::path& path);

  std::uint64_t size() const { return size_; }
  const std::string& name() const { return name_; }
  /// Fills `bytes` from `offset`. Throws Error{io}.
  void read(std::uint64_t offset, std::span<std::byte> bytes) const;
  /// Whether `descriptor` is this very file.
  bool is(int descriptor) const { return file_.is_same(descriptor); }

 private:
  std::string name_;
  platform::File file_;
  std::uint64_t size_ = 0;
};

/// A dataset that passed: contiguous, unfiltered, local, of a known type, and wholly inside its file.
struct StoredDataset {
  ElementType type = ElementType::u8;
  std::size_t width = 1;             ///< bytes of one element
  std::vector<std::uint64_t> shape;  ///< slowest first
  std::uint64_t offset = 0;          ///< in the file
  std::uint64_t bytes = 0;
  std::uint64_t digest = 0;  ///< XXH64 as the file has it
};

struct Catalogue {
  InputFile file;
  std::map<std::string, StoredDataset> datasets;  ///< by absolute path
  std::set<std::string> groups;                   ///< looked into, by absolute path
  std::int32_t minor = 0;                         ///< of the format
};

/// Opens what the table of digests lists, and nothing else: the table is the file's contents page, so that no
/// group has to be listed (HDF5 1.10 can crash on listing a damaged group) and what others put beside a model
/// is never touched. Throws Error{missing_input, data}, naming the dataset, for whatever is not a plain
/// dataset, for soft and external links, for more members or bytes than a file of this size can hold, and for
/// another major version.
Catalogue inspect(const std::filesystem::path& path);

}  // namespace ecorche::model_file
