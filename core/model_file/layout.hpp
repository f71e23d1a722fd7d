// SPDX-License-Identifier: Apache-2.0
// Which datasets a model is made of: the one list that the writer stores and `identity` hashes
// (docs/reference/model.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <ecorche/values/model.hpp>
#include "core/model_file/element_type.hpp"

namespace ecorche::model_file {

/// VTK's number for a tetrahedron.
inline constexpr std::uint8_t kVtkTetra = 10;

/// One dataset, seen in memory: row-major, little-endian.
struct Entry {
  std::string path;  ///< absolute in the file
  ElementType type = ElementType::u8;
  std::vector<std::uint64_t> shape;
  std::size_t width = 1;             ///< bytes of one element
  std::span<const std::byte> bytes;  ///< width times the product of shape
};

/// Entries in a fixed order; large arrays are views into the model, which must outlive the layout.
class Layout {
 public:
  const std::vector<Entry>& entries() const { return entries_; }

  /// A view of `values`.
  template <class T>
  void view(std::string path, std::span<const T> values, std::vector<std::uint64_t> shape) {
    entries_.push_back(
        {std::move(path), element_type_of<T>, std::move(shape), sizeof(T), std::as_bytes(values)});
  }
  /// A copy of `values`, by default as one row.
  template <class T>
  void copy(std::string path, const std::vector<T>& values, std::vector<std::uint64_t> shape = {}) {
    const auto bytes = std::as_bytes(std::span<const T>(values));
    kept_.emplace_back(bytes.begin(), bytes.end());
    if (shape.empty()) shape = {values.size()};
    entries_.push_back({std::move(path), element_type_of<T>, std::move(shape), sizeof(T), kept_.back()});
  }
  template <class T>
  void scalar(std::string path, T value) {
    copy(std::move(path), std::vector<T>{value});
  }
  /// Text, each padded with NUL to the width of the longest.
  void texts(std::string path, const std::vector<std::string>& values);
  /// Bytes whose meaning `type` says (voxels).
  void raw(std::string path, ElementType type, std::span<const std::byte> bytes,
           std::vector<std::uint64_t> shape);

 private:
  std::vector<Entry> entries_;
  std::vector<std::vector<std::byte>> kept_;  // moving the outer vector leaves the bytes where they are
};

/// Everything that a model is. Provenance lies under `/ecorche/provenance/`.
Layout lay_out(const Model& model);

/// The lowest minor version of the format that has all of it: a model without what is new stays as it was,
/// to the byte.
std::int32_t minor_of(const Model& model);

/// What VTKHDF readers need or show beside that, derived from the model: counts, cell types, offsets, the
/// heaviest segment of every node.
Layout lay_out_vtk(const Model& model);

}  // namespace ecorche::model_file
