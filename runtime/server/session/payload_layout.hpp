// SPDX-License-Identifier: Apache-2.0
// The arrays of one payload, copied at once.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <ecorche/wire/framing.hpp>
#include "proto/arrays.hpp"

namespace ecorche::server {

/// First every array is told, then fill() copies them, by several threads where there is much: one after
/// another, a whole body's copies would take as long as posing it. What is added must stay until then.
class PayloadLayout {
 public:
  /// The next array begins; its bytes follow by add().
  void begin(v1::Array& array, v1::ScalarType type, std::uint32_t components);
  void add(std::span<const std::byte> bytes);
  /// Sets the array's count: all that was added since begin(), in rows of `row` bytes.
  void end(std::size_t row);
  /// All at once.
  template <class T>
  void append(v1::Array& array, v1::ScalarType type, std::uint32_t components, std::span<const T> values) {
    begin(array, type, components);
    add(std::as_bytes(values));
    end(components * sizeof(T));
  }

  /// Replaces what `payload` holds; zeros lie between the arrays.
  void fill(wire::Payload& payload) const;
  /// Copies nothing: the same payload as it lies, kept by `owner`.
  wire::Pieces pieces(std::shared_ptr<const void> owner) const;

 private:
  struct Piece {
    std::span<const std::byte> from;
    std::size_t to;
  };
  v1::Array* array_ = nullptr;
  std::vector<Piece> pieces_;
  std::vector<std::size_t> ends_;  // of arrays, before their padding
  std::size_t size_ = 0;
};

}  // namespace ecorche::server
