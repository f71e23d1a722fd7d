// SPDX-License-Identifier: Apache-2.0
// What stands in an XML PolyData file, array by array, before any of it is believed.
#pragma once

#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "io/surface/vtp_arrays.hpp"

namespace ecorche::io::vtp {

struct Piece {
  Attributes attributes;
  /// By section (`Points`, `Polys`, ...), then by name; the points' array is named "".
  std::map<std::string, std::map<std::string, DataArray>> sections;

  /// Null where it is not there.
  const DataArray* find(const std::string& section, const std::string& name) const;
};

struct Document {
  Storage storage;
  std::vector<Piece> pieces;
  std::map<std::string, DataArray> fields;  ///< of FieldData, numbers and strings, by name
  std::uint64_t largest = 0;                ///< no array of this file can hold more values
};

/// The arrays of `sections` and of the field data; `file` must outlive the document. Throws Error{data}: no
/// XML, no PolyData, a DOCTYPE, arrays packed by anything but zlib.
Document parse(std::string_view file, std::initializer_list<std::string_view> sections,
               const std::string& where);

/// A count among a piece's attributes, 0 where it is missing. Throws Error{data} for more than the file can
/// hold.
std::uint64_t count(const Document& document, const Piece& piece, std::string_view key,
                    const std::string& where);

/// A string array's bytes, at most `limit`, each string with its NUL. Throws Error{data}.
std::string letters(const DataArray& array, const Storage& storage, std::uint64_t limit,
                    const std::string& where);

}  // namespace ecorche::io::vtp
