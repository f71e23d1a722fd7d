// SPDX-License-Identifier: Apache-2.0
// nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h
#include "io/image/packed_nifti.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <memory>

#include <ecorche/values/error.hpp>

#include "io/image/gzip_stream.hpp"
#include "io/image/itk_images.hpp"

namespace ecorche::io {
namespace {

constexpr std::size_t kHead = 352;  // the header and the four bytes of "no extension"
constexpr std::size_t kSizes = 42;  // where three int16 say how many voxels
using Head = std::array<std::byte, kHead>;

[[noreturn]] void not_written(const std::filesystem::path& path) {
  throw Error(ErrorKind::io, path.string(), "writing failed", "check the disk's free space");
}

// ITK's own header: of eight voxels that lie as the image does, with the image's sizes put in. What `path`
// holds afterwards is to be written over.
Head head_of(const std::filesystem::path& path, const Image& image) {
  ImageGrid grid = image.grid;
  grid.size = {2, 2, 2};
  itk_images::write(path, itk_images::Format::nifti, Image(grid, image.type, image.components), true);
  Head head{};
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose);
  if (file == nullptr || gzread(file.get(), head.data(), kHead) != static_cast<int>(kHead)) not_written(path);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto size = static_cast<std::int16_t>(image.grid.size[axis]);
    std::memcpy(head.data() + kSizes + axis * sizeof size, &size, sizeof size);
  }
  return head;
}

// The voxels as the format has them: one component after another.
class Voxels {
 public:
  explicit Voxels(const Image& image)
      : image_(image),
        components_(static_cast<std::size_t>(image.components)),
        voxels_(image.grid.voxels()) {}
  /// From the byte `begin` on; both ends lie between two numbers.
  void read(std::size_t begin, std::span<std::byte> out) const {
    if (components_ == 1) {
      std::memcpy(out.data(), image_.bytes.data() + begin, out.size());
    } else {
      with_scalar_type(image_.type, [&](auto number) { gather<decltype(number)>(begin, out); });
    }
  }

 private:
  template <class T>
  void gather(std::size_t begin, std::span<std::byte> out) const {
    const std::span<const T> stored = image_.scalars<T>();
    std::size_t component = begin / sizeof(T) / voxels_, voxel = begin / sizeof(T) % voxels_;
    for (std::size_t at = 0; at < out.size(); at += sizeof(T)) {
      std::memcpy(out.data() + at, &stored[voxel * components_ + component], sizeof(T));
      if (++voxel == voxels_) {
        voxel = 0;
        ++component;
      }
    }
  }

  const Image& image_;
  std::size_t components_, voxels_;
};

}  // namespace

void write_packed_nifti(const std::filesystem::path& path, const Image& image) {
  const Head head = head_of(path, image);
  const Voxels voxels(image);
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  write_gzip(file, kHead + image.bytes.size(), [&](std::size_t begin, std::span<std::byte> out) {
    if (begin < kHead) {
      const std::size_t of_head = std::min(kHead - begin, out.size());
      std::memcpy(out.data(), head.data() + begin, of_head);
      out = out.subspan(of_head);
      begin += of_head;
    }
    if (!out.empty()) voxels.read(begin - kHead, out);
  });
  file.close();
  if (!file) not_written(path);
}

}  // namespace ecorche::io
