// SPDX-License-Identifier: Apache-2.0
#include "proto/arrays.hpp"

namespace ecorche::wire {

// The wire's numbers are ours plus one; 0 is "unspecified".
v1::ScalarType to_proto(ScalarType type) {
  return static_cast<v1::ScalarType>(static_cast<int>(type) + 1);
}
static_assert(static_cast<int>(ScalarType::u8) + 1 == v1::SCALAR_TYPE_U8);
static_assert(static_cast<int>(ScalarType::i16) + 1 == v1::SCALAR_TYPE_I16);
static_assert(static_cast<int>(ScalarType::f64) + 1 == v1::SCALAR_TYPE_F64);

bool from_proto(v1::ScalarType type, ScalarType& out) {
  if (type < v1::SCALAR_TYPE_U8 || type > v1::SCALAR_TYPE_F64) return false;
  out = static_cast<ScalarType>(static_cast<int>(type) - 1);
  return true;
}

v1::Array append(Payload& payload, std::span<const std::byte> bytes, ScalarType type,
                 std::uint32_t components) {
  v1::Array array;
  array.set_type(to_proto(type));
  array.set_components(components);
  array.set_count(bytes.size() / scalar_bytes(type) / components);
  array.set_offset(payload.size());
  payload.insert(payload.end(), bytes.begin(), bytes.end());
  payload.resize(aligned(payload.size()));
  return array;
}

bool find(const v1::Array& array, const Payload& payload, std::span<const std::byte>& out) {
  ScalarType type{};
  if (!from_proto(array.type(), type) || array.components() == 0 || array.offset() % alignment != 0)
    return false;
  if (array.offset() > payload.size()) return false;
  // At most 2^32 * 8: no overflow.
  const std::uint64_t row = std::uint64_t{array.components()} * scalar_bytes(type);
  const std::uint64_t room = payload.size() - array.offset();
  if (array.count() > room / row) return false;
  out = std::span(payload).subspan(array.offset(), array.count() * row);
  return true;
}

}  // namespace ecorche::wire
