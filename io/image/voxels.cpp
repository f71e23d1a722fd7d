// SPDX-License-Identifier: Apache-2.0
// Voxels as they are stored become voxels of this machine: byte order, components together, scale.
#include <algorithm>
#include <cstring>

#include "io/image/header.hpp"

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

template <class To>
void scale(const Image& stored, const ImageHeader& header, Image& image) {
  with_scalar_type(stored.type, [&](auto zero) {
    const auto from = stored.scalars<decltype(zero)>();
    const auto to = image.scalars<To>();
    for (std::size_t i = 0; i < from.size(); ++i)
      to[i] = static_cast<To>(static_cast<double>(from[i]) * header.slope + header.intercept);
  });
}

}  // namespace

void read_voxels(const ImageHeader& header, const std::filesystem::path& path, Image& image) {
  std::vector<std::byte> bytes = stored_voxels(header, path);
  const std::size_t size = scalar_bytes(header.type);
  if (header.swapped) swap_bytes(bytes, size);
  if (header.planar && header.components > 1)
    bytes = interleave(bytes, static_cast<std::size_t>(header.components), size);
  if (!header.scaled) {
    image.bytes = std::move(bytes);
    return;
  }
  Image stored;
  stored.type = header.type;
  stored.bytes = std::move(bytes);
  image.bytes.resize(stored.bytes.size() / size * scalar_bytes(image.type));
  image.type == ScalarType::f64 ? scale<double>(stored, header, image) : scale<float>(stored, header, image);
}

}  // namespace ecorche::io
