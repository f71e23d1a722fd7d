// SPDX-License-Identifier: Apache-2.0
#include <png.h>

#include <bit>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"
#include "io/image/grey_picture.hpp"

namespace ecorche::io {
namespace {

// libpng jumps back where it fails; what it said is kept for then.
struct Failure {
  std::jmp_buf back;
  char what[200] = "";
};

void fail(png_structp png, png_const_charp what) {
  auto* failure = static_cast<Failure*>(png_get_error_ptr(png));
  std::snprintf(failure->what, sizeof failure->what, "%s", what);
  std::longjmp(failure->back, 1);
}

void stay_silent(png_structp, png_const_charp) {}

png_uint_32 per_metre(double mm) {
  return static_cast<png_uint_32>(std::lround(1000 / mm));
}

// Nothing here has a destructor: libpng may jump over it. False: failed.
bool write(std::FILE* file, const GreyPicture& picture, png_bytepp rows, Failure& failure) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &failure, fail, stay_silent);
  if (png == nullptr) return false;
  png_infop info = png_create_info_struct(png);
  if (info == nullptr || setjmp(failure.back) != 0) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_init_io(png, file);
  png_set_IHDR(png, info, static_cast<png_uint_32>(picture.width), static_cast<png_uint_32>(picture.height),
               16, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_set_pHYs(png, info, per_metre(picture.pixel_mm[0]), per_metre(picture.pixel_mm[1]),
               PNG_RESOLUTION_METER);
  png_write_info(png, info);
  if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
  png_write_image(png, rows);
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return true;
}

}  // namespace

void write_png(const std::filesystem::path& path, const GreyPicture& picture) {
  files::AtomicFile target(path);
  std::vector<png_bytep> rows(static_cast<std::size_t>(picture.height));
  for (std::size_t y = 0; y < rows.size(); ++y) {
    const std::uint16_t* row = &picture.grey[y * static_cast<std::size_t>(picture.width)];
    rows[y] = reinterpret_cast<png_bytep>(const_cast<std::uint16_t*>(row));  // only read
  }
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(target.temporary().c_str(), "wb"),
                                                       std::fclose);
  Failure failure;
  const bool written =
      file && write(file.get(), picture, rows.data(), failure) && std::fflush(file.get()) == 0;
  if (!written) {
    throw Error(ErrorKind::io, path.string(),
                std::string("cannot write the picture") + (failure.what[0] == 0 ? "" : ": ") + failure.what,
                "check the disk");
  }
  file.reset();
  target.commit();
}

}  // namespace ecorche::io
