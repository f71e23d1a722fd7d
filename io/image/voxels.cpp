// SPDX-License-Identifier: Apache-2.0
// Voxels as they are stored become voxels of this machine: byte order, components together, scale.
#include <algorithm>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

#include "io/image/header.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io {
namespace {

void swap_bytes(std::vector<std::byte>& bytes, std::size_t size) {
  for (std::size_t at = 0; size > 1 && at + size <= bytes.size(); at += size)
    std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                 bytes.begin() + static_cast<std::ptrdiff_t>(at + size));
}

// One volume a component becomes one voxel after the other.
std::vector<std::byte> interleave(const std::vector<std::byte>& planes, std::size_t components,
                                  std::size_t size) {
  std::vector<std::byte> out(planes.size());
  const std::size_t voxels = planes.size() / components / size;
  for (std::size_t c = 0; c < components; ++c) {
    for (std::size_t v = 0; v < voxels; ++v)
      std::memcpy(out.data() + (v * components + c) * size, planes.data() + (c * voxels + v) * size, size);
  }
  return out;
}

// Calls `f` with the scalars as they are stored.
template <class F>
void with_stored(const ImageHeader& header, const std::vector<std::byte>& bytes, F&& f) {
  const auto as = [&](auto zero) {
    using T = decltype(zero);
    f(std::span(reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)));
  };
  if (header.wide) {
    header.wide_unsigned ? as(std::uint64_t{}) : as(std::int64_t{});
  } else {
    with_scalar_type(header.type, as);
  }
}

template <class To, class From>
void scale(std::span<const From> from, const ImageHeader& header, Image& image) {
  std::transform(from.begin(), from.end(), image.scalars<To>().begin(), [&](From x) {
    return static_cast<To>(static_cast<double>(x) * header.slope + header.intercept);
  });
}

template <class From>
void narrow(std::span<const From> from, Image& image, const std::filesystem::path& path) {
  const auto to = image.scalars<std::int32_t>();
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (!std::in_range<std::int32_t>(from[i]))
      fields::refuse(path, "holds the value " + std::to_string(from[i]),
                     "whole numbers fit 32 bits: save them so");
    to[i] = static_cast<std::int32_t>(from[i]);
  }
}

}  // namespace

void read_voxels(const ImageHeader& header, const std::filesystem::path& path, std::vector<std::byte> bytes,
                 Image& image) {
  const std::size_t size = header.stored_bytes();
  if (header.swapped) swap_bytes(bytes, size);
  if (header.planar && header.components > 1)
    bytes = interleave(bytes, static_cast<std::size_t>(header.components), size);
  if (!header.scaled && !header.wide) {
    image.bytes = std::move(bytes);
    return;
  }
  image.bytes.resize(bytes.size() / size * scalar_bytes(image.type));
  with_stored(header, bytes, [&](auto from) {
    using From = typename decltype(from)::value_type;
    if constexpr (std::is_integral_v<From>) {
      if (!header.scaled) return narrow<From>(from, image, path);
    }
    image.type == ScalarType::f64 ? scale<double, From>(from, header, image)
                                  : scale<float, From>(from, header, image);
  });
}

}  // namespace ecorche::io
