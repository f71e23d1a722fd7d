// SPDX-License-Identifier: Apache-2.0
// Sampled volumes. Only the standard library here: ITK brings its own Eigen.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ecorche {

/// Where the voxels of an image lie: voxel (i, j, k) is centred at
/// origin + direction * (spacing .* (i, j, k)), patient LPS, mm.
struct ImageGrid {
  std::array<std::int32_t, 3> size{0, 0, 0};  ///< voxels along i, j, k; i runs fastest in memory
  std::array<double, 3> origin{0, 0, 0};      ///< centre of voxel (0, 0, 0), mm
  std::array<double, 3> spacing{1, 1, 1};     ///< mm, positive
  std::array<double, 9> direction{1, 0, 0, 0, 1,
                                  0, 0, 0, 1};  ///< row-major, orthonormal; columns are the axes

  /// How many.
  std::size_t voxels() const {
    return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
           static_cast<std::size_t>(size[2]);
  }
  /// Of voxel (i, j, k) in memory order.
  std::size_t offset(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(size[0]) *
               (static_cast<std::size_t>(j) +
                static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(k));
  }
  /// The point, LPS mm, of a continuous index.
  std::array<double, 3> point(double i, double j, double k) const;
  /// The continuous index of a point, LPS mm (direction is orthonormal, so its inverse is its transpose).
  std::array<double, 3> index(const std::array<double, 3>& point) const;

  /// Equal in every member.
  bool operator==(const ImageGrid&) const = default;
};

enum class ScalarType : std::uint8_t { u8, i8, u16, i16, u32, i32, f32, f64 };

/// Bytes of one scalar.
std::size_t scalar_bytes(ScalarType type);
/// `u8`, `i16`, ...
std::string_view scalar_name(ScalarType type);

template <class T>
inline constexpr ScalarType scalar_type_of = ScalarType::u8;
template <>
inline constexpr ScalarType scalar_type_of<std::int8_t> = ScalarType::i8;
template <>
inline constexpr ScalarType scalar_type_of<std::uint16_t> = ScalarType::u16;
template <>
inline constexpr ScalarType scalar_type_of<std::int16_t> = ScalarType::i16;
template <>
inline constexpr ScalarType scalar_type_of<std::uint32_t> = ScalarType::u32;
template <>
inline constexpr ScalarType scalar_type_of<std::int32_t> = ScalarType::i32;
template <>
inline constexpr ScalarType scalar_type_of<float> = ScalarType::f32;
template <>
inline constexpr ScalarType scalar_type_of<double> = ScalarType::f64;

/// A sampled volume of one or several components per voxel (interleaved).
struct Image {
  ImageGrid grid;
  ScalarType type = ScalarType::u8;
  int components = 1;
  std::vector<std::byte> bytes;  ///< grid.voxels() * components scalars, i fastest

  Image() = default;
  /// All bytes zero.
  Image(const ImageGrid& grid_, ScalarType type_, int components_ = 1)
      : grid(grid_),
        type(type_),
        components(components_),
        bytes(grid_.voxels() * static_cast<std::size_t>(components_) * scalar_bytes(type_)) {}

  /// The scalars as T; T must be the image's own type (asserted).
  template <class T>
  std::span<T> scalars() {
    check_type(scalar_type_of<T>);
    return {reinterpret_cast<T*>(bytes.data()), bytes.size() / sizeof(T)};
  }
  /// All numbers, components side by side. Throws Error where they are of another type.
  template <class T>
  std::span<const T> scalars() const {
    check_type(scalar_type_of<T>);
    return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
  }

 private:
  void check_type(ScalarType asked) const;  // throws Error{internal}
};

/// Calls `f(T{})` with a value of the C++ type that `type` names.
template <class F>
decltype(auto) with_scalar_type(ScalarType type, F&& f) {
  switch (type) {
    case ScalarType::u8:
      return f(std::uint8_t{});
    case ScalarType::i8:
      return f(std::int8_t{});
    case ScalarType::u16:
      return f(std::uint16_t{});
    case ScalarType::i16:
      return f(std::int16_t{});
    case ScalarType::u32:
      return f(std::uint32_t{});
    case ScalarType::i32:
      return f(std::int32_t{});
    case ScalarType::f32:
      return f(float{});
    case ScalarType::f64:
      break;
  }
  return f(double{});
}

/// The values that an image of whole numbers holds, ascending; more than `most` where it holds more, then not
/// all of them. Throws Error{internal} for float voxels. O(voxels).
std::vector<std::int64_t> distinct_values(const Image& image, std::size_t most);

}  // namespace ecorche
