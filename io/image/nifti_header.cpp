// SPDX-License-Identifier: Apache-2.0
// https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h and nifti2.h
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <span>
#include <string_view>

#include "core/values/text.hpp"
#include "io/image/header.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io {
namespace {

using fields::refuse;
using Path = std::filesystem::path;

// Fixed fields at fixed places, in either byte order.
class Bytes {
 public:
  Bytes(std::string_view head, bool swap) : head_(head), swap_(swap) {}

  template <class T>
  T at(std::size_t offset) const {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), head_.data() + offset, sizeof(T));
    if (swap_) std::reverse(raw.begin(), raw.end());
    T value;
    std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }

 private:
  std::string_view head_;
  bool swap_;
};

// What of the two versions matters here.
struct NiftiFields {
  std::array<std::int64_t, 8> dim{};
  int datatype = 0, units = 0, qform = 0, sform = 0;
  double offset = 0, slope = 0, intercept = 0;
  std::array<double, 8> pixdim{};
  std::array<double, 6> quaternion{};  // b, c, d and the offsets
  std::array<double, 12> rows{};       // of the sform
};

NiftiFields first_version(const Bytes& bytes) {
  NiftiFields f;
  for (std::size_t i = 0; i < 8; ++i) f.dim[i] = bytes.at<std::int16_t>(40 + 2 * i);
  f.datatype = bytes.at<std::int16_t>(70);
  f.offset = static_cast<double>(bytes.at<float>(108));
  f.slope = static_cast<double>(bytes.at<float>(112));
  f.intercept = static_cast<double>(bytes.at<float>(116));
  f.units = bytes.at<std::uint8_t>(123);
  f.qform = bytes.at<std::int16_t>(252);
  f.sform = bytes.at<std::int16_t>(254);
  for (std::size_t i = 0; i < 8; ++i) f.pixdim[i] = static_cast<double>(bytes.at<float>(76 + 4 * i));
  for (std::size_t i = 0; i < 6; ++i) f.quaternion[i] = static_cast<double>(bytes.at<float>(256 + 4 * i));
  for (std::size_t i = 0; i < 12; ++i) f.rows[i] = static_cast<double>(bytes.at<float>(280 + 4 * i));
  return f;
}

NiftiFields second_version(const Bytes& bytes) {
  NiftiFields f;
  for (std::size_t i = 0; i < 8; ++i) f.dim[i] = bytes.at<std::int64_t>(16 + 8 * i);
  f.datatype = bytes.at<std::int16_t>(12);
  f.offset = static_cast<double>(bytes.at<std::int64_t>(168));
  f.slope = bytes.at<double>(176);
  f.intercept = bytes.at<double>(184);
  f.units = bytes.at<std::int32_t>(500);
  f.qform = bytes.at<std::int32_t>(344);
  f.sform = bytes.at<std::int32_t>(348);
  for (std::size_t i = 0; i < 8; ++i) f.pixdim[i] = bytes.at<double>(104 + 8 * i);
  for (std::size_t i = 0; i < 6; ++i) f.quaternion[i] = bytes.at<double>(352 + 8 * i);
  for (std::size_t i = 0; i < 12; ++i) f.rows[i] = bytes.at<double>(400 + 8 * i);
  return f;
}

// By the qform or the sform. NIfTI's x and y point right and anterior.
ImageGrid grid_of(const NiftiFields& f, const std::array<std::int32_t, 3>& size, bool by_qform) {
  std::array<std::array<double, 3>, 3> axis{};
  std::array<double, 3> origin{};
  if (by_qform) {
    const auto [b, c, d, x, y, z] = f.quaternion;
    const double a = std::sqrt(std::max(0.0, 1 - b * b - c * c - d * d));
    const double side = f.pixdim[0] < 0 ? -1 : 1;
    axis = {
        {{a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)},
         {2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)},
         {side * 2 * (b * d + a * c), side * 2 * (c * d - a * b), side * (a * a + d * d - c * c - b * b)}}};
    for (std::size_t k = 0; k < 3; ++k) {
      for (double& v : axis[k]) v *= f.pixdim[k + 1];
    }
    origin = {x, y, z};
  } else {
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t k = 0; k < 3; ++k) axis[k][row] = f.rows[4 * row + k];
      origin[row] = f.rows[4 * row + 3];
    }
  }
  ImageGrid grid;
  grid.size = size;
  for (std::size_t k = 0; k < 3; ++k) {
    grid.spacing[k] = std::hypot(axis[k][0], axis[k][1], axis[k][2]);
    for (std::size_t row = 0; row < 3; ++row)
      grid.direction[3 * row + k] = (row < 2 ? -1 : 1) * axis[k][row] / grid.spacing[k];
    grid.origin[k] = (k < 2 ? -1 : 1) * origin[k];
  }
  return grid;
}

// The farthest that a corner lies by one grid from where it lies by the other, mm.
double apart(const ImageGrid& a, const ImageGrid& b) {
  double most = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const auto at = [&](const ImageGrid& grid) {
      return grid.point((corner & 1) != 0 ? grid.size[0] - 1 : 0, (corner & 2) != 0 ? grid.size[1] - 1 : 0,
                        (corner & 4) != 0 ? grid.size[2] - 1 : 0);
    };
    const auto p = at(a), q = at(b);
    const double mm = std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
    if (!std::isfinite(mm)) return mm;
    most = std::max(most, mm);
  }
  return most;
}

// ITK ends the program at an affine that is no number.
void check_finite(const NiftiFields& f, const Path& path) {
  const auto check = [&](std::string_view name, const auto& values) {
    if (std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) return;
    refuse(path, "its " + std::string(name) + " has a NaN or an infinite number", "write its header anew");
  };
  check("pixdim", std::span(f.pixdim).first(4));
  if (f.qform > 0) check("qform", f.quaternion);
  if (f.sform > 0) check("sform", f.rows);
}

// Where both forms stand and agree, the qform: it is right-angled, and ITK takes it too. A NaN does not
// agree.
ImageGrid placed(const NiftiFields& f, const std::array<std::int32_t, 3>& size, NiftiForm form,
                 const Path& path) {
  check_finite(f, path);
  const ImageGrid one = grid_of(f, size, f.qform > 0 && form != NiftiForm::sform);
  if (form != NiftiForm::either || f.qform <= 0 || f.sform <= 0) return one;
  const double mm = apart(one, grid_of(f, size, false));
  if (mm <= 0.5 * *std::min_element(one.spacing.begin(), one.spacing.end())) return one;
  refuse(path, "its qform and its sform lie " + text::number(mm) + " mm apart",
         "write the image with one of them, or say in the case which counts: form: qform, or form: sform");
}

void set_type(ImageHeader& header, int datatype, const Path& path) {
  switch (datatype) {
    case 2:
      header.type = ScalarType::u8;
      return;
    case 4:
      header.type = ScalarType::i16;
      return;
    case 8:
      header.type = ScalarType::i32;
      return;
    case 16:
      header.type = ScalarType::f32;
      return;
    case 64:
      header.type = ScalarType::f64;
      return;
    case 128:  // RGB, a byte each
      header.type = ScalarType::u8;
      header.components *= 3;
      return;
    case 2304:  // RGBA
      header.type = ScalarType::u8;
      header.components *= 4;
      return;
    case 256:
      header.type = ScalarType::i8;
      return;
    case 512:
      header.type = ScalarType::u16;
      return;
    case 768:
      header.type = ScalarType::u32;
      return;
    case 1024:
      return fields::set_wide(header, false);
    case 1280:
      return fields::set_wide(header, true);
    default:
      refuse(path, "voxels of NIfTI type " + std::to_string(datatype) + " cannot be read",
             "convert them to 8, 16, 32 or 64-bit integers, float, double or RGB");
  }
}

void set_size(ImageHeader& header, const NiftiFields& f, const Path& path) {
  if (f.dim[0] < 3 || f.dim[0] > 7)
    refuse(path, "has " + std::to_string(f.dim[0]) + " axes", "save a 3-D image");
  for (std::size_t axis = 1; axis <= static_cast<std::size_t>(f.dim[0]); ++axis) {
    const std::int64_t size = f.dim[axis];
    if (size < 1 || size > std::numeric_limits<std::int32_t>::max())
      refuse(path, "axis " + std::to_string(axis) + " has " + std::to_string(size) + " voxels");
    if (axis <= 3) header.size[axis - 1] = static_cast<std::int32_t>(size);
    if (axis == 5) header.components = static_cast<int>(std::min<std::int64_t>(size, 1 << 16));
    if (axis == 4) header.volumes = fields::volumes_of(size, path);
    if (axis > 5 && size != 1) {
      refuse(path, "has " + std::to_string(size) + " volumes on axis " + std::to_string(axis),
             "save one 3-D image; volumes in time are the fourth axis, components of a voxel the fifth");
    }
  }
  if (header.volumes > 1 && header.components > 1)
    refuse(path,
           "holds " + std::to_string(header.volumes) + " volumes in time of " +
               std::to_string(header.components) + " numbers a voxel",
           "save one 3-D image");
}

}  // namespace

ImageHeader parse_nifti_header(std::string_view head, const Path& path, NiftiForm form) {
  if (head.size() < 348)
    refuse(path, "is no NIfTI: it has " + std::to_string(head.size()) + " bytes of header");
  const Bytes plain(head, false), swapped(head, true);
  const bool second = plain.at<std::int32_t>(0) == 540 || swapped.at<std::int32_t>(0) == 540;
  const std::int32_t length = second ? 540 : 348;
  const bool swap = swapped.at<std::int32_t>(0) == length;
  if ((!swap && plain.at<std::int32_t>(0) != length) || head.size() < static_cast<std::size_t>(length))
    refuse(path, "is no NIfTI: its header does not say 348 bytes, or 540 of a NIfTI-2, or ends before");
  const std::string_view magic = head.substr(second ? 4 : 344, 4);
  if (magic == std::string_view("ni1\0", 4) || magic == std::string_view("ni2\0", 4))
    refuse(path, "its voxels are in another file", "save it as one .nii or .nii.gz");
  if (magic != std::string_view(second ? "n+2\0" : "n+1\0", 4))
    refuse(path, "is no NIfTI: it lacks the magic 'n+1', or 'n+2' of a NIfTI-2",
           "Analyze files do not say left from right: convert it");
  ImageHeader header;
  const Bytes& bytes = swap ? swapped : plain;
  const NiftiFields f = second ? second_version(bytes) : first_version(bytes);
  set_size(header, f, path);
  set_type(header, f.datatype, path);
  fields::check_size(header, path);
  if (!(f.offset >= length + 4 && f.offset <= 1e6) || f.offset != std::floor(f.offset))
    refuse(path, "its voxels begin at byte " + std::to_string(f.offset),
           "they must begin at 352, or 544 of a NIfTI-2, or a little later");
  if ((f.units & 7) != 0 && (f.units & 7) != 2)
    refuse(path, "its unit of length is NIfTI's " + std::to_string(f.units & 7), "write it in mm");
  // Without either there is a convention for axes, but nobody keeps to it: left and right would be a guess.
  if (f.qform <= 0 && f.sform <= 0)
    refuse(path, "does not say where it lies: qform_code and sform_code are 0", "set its sform");
  if ((form == NiftiForm::qform && f.qform <= 0) || (form == NiftiForm::sform && f.sform <= 0)) {
    const std::string name = form == NiftiForm::qform ? "qform" : "sform";
    refuse(path, "has no " + name + ": its code is 0", "leave out form: " + name);
  }
  header.scaled = f.slope != 0 && std::isfinite(f.slope) && (f.slope != 1 || f.intercept != 0);
  header.slope = header.scaled ? f.slope : 1;
  header.intercept = header.scaled && std::isfinite(f.intercept) ? f.intercept : 0;
  header.swapped = swap;
  header.second_version = second;
  header.grid = placed(f, header.size, form, path);
  header.planar = f.dim[0] >= 5 && f.datatype != 128 && f.datatype != 2304;
  header.data_file = path;
  header.data_offset = static_cast<std::uint64_t>(f.offset);
  return header;
}

}  // namespace ecorche::io
