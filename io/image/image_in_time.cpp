// SPDX-License-Identifier: Apache-2.0
// Images of several volumes in time, of which one is read.
#include <cstring>
#include <string>

#include "io/image/header.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io {

void choose_volume(ImageHeader& header, int phase, const std::filesystem::path& path) {
  if (header.may_be_volumes && phase != 0) {
    header.volumes = header.components;
    header.volumes_first = true;
  }
  const std::string count = std::to_string(header.volumes);
  if (phase == 0 && header.volumes > 1)
    fields::refuse(path, "holds " + count + " volumes, one after the other in time",
                   "take one by --phase, in a case by phase:, from 1 to " + count);
  if (phase > header.volumes)
    fields::refuse(path, "has no phase " + std::to_string(phase), "it has " + count);
  if (header.volumes > 1 && !header.grid)
    fields::refuse(path, "holds volumes in time, but does not say in which space they lie",
                   "write it with 'space' and 'space origin'");
  if (header.volumes == 1 || header.volumes_first) return;
  const auto before = static_cast<std::uint64_t>(phase - 1);
  header.bytes_before = before * header.voxel_bytes();
  header.bytes_behind = (static_cast<std::uint64_t>(header.volumes) - 1 - before) * header.voxel_bytes();
}

Image one_component(const Image& image, int component) {
  Image out(image.grid, image.type);
  const std::size_t size = scalar_bytes(image.type), step = size * static_cast<std::size_t>(image.components);
  const std::byte* from = image.bytes.data() + size * static_cast<std::size_t>(component);
  for (std::size_t at = 0; at < out.bytes.size(); at += size, from += step)
    std::memcpy(out.bytes.data() + at, from, size);
  return out;
}

}  // namespace ecorche::io
