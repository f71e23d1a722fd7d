// SPDX-License-Identifier: Apache-2.0
// Raw arrays in a payload, each on 16 bytes, described by v1::Array.
#pragma once

#include <bit>
#include <cstddef>
#include <span>
#include <type_traits>

#include <ecorche/values/image.hpp>
#include <ecorche/wire/framing.hpp>

namespace ecorche::wire {

static_assert(std::endian::native == std::endian::little,
              "payloads are little-endian and copied as they stand");

v1::ScalarType to_proto(ScalarType type);
/// False when `type` names none.
bool from_proto(v1::ScalarType type, ScalarType& out);

/// Appends `bytes`, which hold rows of `components` scalars, and zeros up to a multiple of 16.
v1::Array append(Payload& payload, std::span<const std::byte> bytes, ScalarType type,
                 std::uint32_t components);

/// Appends scalars. T: a type of ScalarType.
template <class T>
v1::Array append(Payload& payload, std::span<const T> scalars, std::uint32_t components) {
  return append(payload, std::as_bytes(scalars), scalar_type_of<T>, components);
}

/// The bytes that `array` describes; false when it is misaligned, of an unknown type or reaches beyond the
/// payload. The sender is not trusted: sums that would wrap are refused too.
bool find(const v1::Array& array, const Payload& payload, std::span<const std::byte>& out);

/// As scalars of T; false also when the array holds another type or another number of components.
template <class T>
bool find(const v1::Array& array, const Payload& payload, std::uint32_t components, std::span<const T>& out) {
  ScalarType type{};
  std::span<const std::byte> bytes;
  if (!from_proto(array.type(), type) || type != scalar_type_of<T> || array.components() != components)
    return false;
  if (!find(array, payload, bytes)) return false;
  out = {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
  return true;
}

}  // namespace ecorche::wire
