// SPDX-License-Identifier: Apache-2.0
// Our own reading of NIfTI's voxels: niftilib, and so ITK, takes those of `a.nii` for `a.nii.gz` where both
// lie side by side. ITK still reads the header a second time.
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include "io/image/header.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io {
namespace {

// zlib reads plain files and gzip streams alike.
std::vector<std::byte> stored_bytes(const ImageHeader& header) {
  const auto path = header.data_file;
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose);
  std::vector<std::byte> out(header.voxel_bytes());
  const std::uint64_t skip = header.gzip ? header.stream_offset : header.data_offset;
  bool good = file != nullptr && gzseek(file.get(), static_cast<z_off_t>(skip), SEEK_SET) >= 0;
  for (std::size_t at = 0; good && at < out.size();) {
    const auto some = static_cast<unsigned>(std::min<std::size_t>(out.size() - at, std::size_t{1} << 28));
    const int got = gzread(file.get(), out.data() + at, some);
    good = got > 0;
    at += static_cast<std::size_t>(std::max(got, 0));
  }
  if (!good) throw Error(ErrorKind::io, path.string(), "reading failed", "check the disk");
  return out;
}

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

void read_nifti_voxels(const ImageHeader& header, Image& image) {
  std::vector<std::byte> bytes = stored_bytes(header);
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
