// SPDX-License-Identifier: Apache-2.0
// What VTK's XML files (.vtp, .vtu) share: pieces with named arrays, somewhere in the file.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "io/surface/vtp_arrays.hpp"

namespace ecorche::io::vtk_xml {

using vtp::Attributes;
using vtp::DataArray;
using vtp::Storage;

struct Piece {
  Attributes attributes;
  /// By section (`Points`, `Polys`, `Cells`, `PointData`, ...), then by name; the points' array is named "".
  std::map<std::string, std::map<std::string, DataArray>> sections;

  /// Null where it is not there.
  const DataArray* find(const std::string& section, const std::string& name) const;
};

struct Document {
  std::vector<Piece> pieces;
  std::map<std::string, DataArray> fields;  ///< of its field data, numbers and strings, by name
  Storage storage;                          ///< refers to the file's bytes
  std::uint64_t largest = 0;                ///< no array of the file holds more values
};

/// The data set of `type` (`PolyData`, `UnstructuredGrid`) that `file` holds: its field data, and the arrays
/// of `sections` of its pieces. `file` and `budget`, which names it and pays for its arrays, must outlive the
/// document. Throws Error{data} for anything else, `mend` says what would be read.
Document parse(std::string_view file, std::string_view type, std::initializer_list<std::string_view> sections,
               const std::string& mend, files::Budget& budget);

/// A count that the piece declares, 0 where it does not; one that the file cannot hold is Error{data}.
std::uint64_t count_of(const Piece& piece, std::string_view key, const Document& document,
                       const std::string& where);

/// Throws Error{data}: `said` of `what` were declared, `found` are there.
[[noreturn]] void fail_count(const std::string& what, std::uint64_t said, std::uint64_t found,
                             const std::string& where);

/// The coordinates of the piece's points, 3 a point. Throws Error{data}.
std::vector<double> points_of(const Piece& piece, const Document& document, const std::string& where);

/// A string array's bytes, at most `limit`, each string with its NUL. Throws Error{data}.
std::string letters(const DataArray& array, const Storage& storage, std::uint64_t limit,
                    const std::string& where);

}  // namespace ecorche::io::vtk_xml
