// SPDX-License-Identifier: Apache-2.0
// What one element of a dataset can be: little-endian numbers, or text of a fixed width.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <ecorche/values/image.hpp>

namespace ecorche::model_file {

static_assert(std::endian::native == std::endian::little,
              "models are little-endian and go between file and memory as they are");

enum class ElementType : std::uint8_t { u8, i8, u16, i16, u32, i32, u64, i64, f32, f64, text };

/// Bytes of one number; 0 for text, whose width belongs to the dataset.
std::size_t element_bytes(ElementType type);
/// `u8`, `f32`, `text`, ...
std::string_view element_name(ElementType type);

ElementType element_type(ScalarType type);

template <class T>
inline constexpr ElementType element_type_of = ElementType::text;
template <>
inline constexpr ElementType element_type_of<std::uint8_t> = ElementType::u8;
template <>
inline constexpr ElementType element_type_of<std::int8_t> = ElementType::i8;
template <>
inline constexpr ElementType element_type_of<std::uint16_t> = ElementType::u16;
template <>
inline constexpr ElementType element_type_of<std::int16_t> = ElementType::i16;
template <>
inline constexpr ElementType element_type_of<std::uint32_t> = ElementType::u32;
template <>
inline constexpr ElementType element_type_of<std::int32_t> = ElementType::i32;
template <>
inline constexpr ElementType element_type_of<std::uint64_t> = ElementType::u64;
template <>
inline constexpr ElementType element_type_of<std::int64_t> = ElementType::i64;
template <>
inline constexpr ElementType element_type_of<float> = ElementType::f32;
template <>
inline constexpr ElementType element_type_of<double> = ElementType::f64;

}  // namespace ecorche::model_file
