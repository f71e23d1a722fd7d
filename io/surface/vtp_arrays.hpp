// SPDX-License-Identifier: Apache-2.0
// The three ways in which VTK's XML files store an array.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <ecorche/files/budget.hpp>
#include "io/surface/byte_reader.hpp"

namespace ecorche::io::vtp {

using Attributes = std::map<std::string, std::string, std::less<>>;

/// How all arrays of a file are stored.
struct Storage {
  bool big_endian = false, wide_header = false, zlib = false, base64_appended = false;
  std::string_view appended;        ///< what follows the underscore of AppendedData
  files::Budget* budget = nullptr;  ///< of the file: arrays may share its bytes
};

/// One DataArray: its attributes and the text between its tags.
struct DataArray {
  Attributes attributes;
  std::string text;

  std::string_view attribute(std::string_view name) const {
    const auto found = attributes.find(name);
    return found == attributes.end() ? std::string_view() : std::string_view(found->second);
  }
};

/// The values as doubles or whole numbers, at most `limit` of them, taken out of the budget. Throws
/// Error{data}.
std::vector<double> reals(const DataArray& array, const Storage& storage, std::uint64_t limit,
                          const std::string& where);
std::vector<std::int64_t> wholes(const DataArray& array, const Storage& storage, std::uint64_t limit,
                                 const std::string& where);

}  // namespace ecorche::io::vtp
