// SPDX-License-Identifier: Apache-2.0
#include "app/igtl/bodies.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include <ecorche/values/error.hpp>

namespace ecorche::app::igtl {
namespace {

constexpr std::size_t kTransformBytes = 48, kTrackingBytes = 70, kPointBytes = 136, kRequestBytes = 36,
                      kPointName = 64, kPointGroup = 32;
constexpr std::uint8_t kTool6d = 2;
constexpr double kFurthestMm = 1e6;

// LPS to RAS, and back.
constexpr std::array<double, 3> kFlip{-1, -1, 1};

void put_columns(Writer& out, const RigidTransform& at) {
  for (const float value : columns_of(at)) out.number(value);
}

Columns load_columns(const std::byte* from) {
  Columns out{};
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = load_big<float>(from + 4 * i);
  return out;
}

std::uint8_t scalar_code(ScalarType type) {
  switch (type) {
    case ScalarType::i8:
      return 2;
    case ScalarType::u8:
      return 3;
    case ScalarType::i16:
      return 4;
    case ScalarType::u16:
      return 5;
    case ScalarType::i32:
      return 6;
    case ScalarType::u32:
      return 7;
    case ScalarType::f32:
      return 10;
    case ScalarType::f64:
      break;
  }
  return 11;
}

}  // namespace

Columns columns_of(const RigidTransform& lps) {
  const Eigen::Matrix3d r = lps.q.toRotationMatrix();
  Columns out{};
  for (std::size_t row = 0; row < 3; ++row) {
    const auto i = static_cast<Eigen::Index>(row);
    for (std::size_t column = 0; column < 3; ++column)
      out[3 * column + row] =
          static_cast<float>(kFlip[row] * r(i, static_cast<Eigen::Index>(column)) * kFlip[column]);
    out[9 + row] = static_cast<float>(kFlip[row] * lps.t[i]);
  }
  return out;
}

std::optional<RigidTransform> transform_of(const Columns& columns) {
  Eigen::Matrix3d r;
  RigidTransform out;
  for (std::size_t row = 0; row < 3; ++row) {
    const auto i = static_cast<Eigen::Index>(row);
    for (std::size_t column = 0; column < 3; ++column)
      r(i, static_cast<Eigen::Index>(column)) =
          kFlip[row] * double{columns[3 * column + row]} * kFlip[column];
    out.t[i] = kFlip[row] * double{columns[9 + row]};
  }
  // Written so that NaN is refused, too.
  const bool rigid = (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= 0.02 &&
                     r.determinant() > 0 && out.t.cwiseAbs().maxCoeff() <= kFurthestMm && r.allFinite() &&
                     out.t.allFinite();
  if (!rigid) return std::nullopt;
  out.q = Eigen::Quaterniond(r).normalized();
  return out;
}

SharedBytes transform_message(const NamedTransform& transform) {
  Writer out;
  put_columns(out, transform.at);
  return std::move(out).sealed("TRANSFORM", transform.name, time_now());
}

SharedBytes tracking_message(std::string_view device, const std::vector<NamedTransform>& tools) {
  Writer out;
  for (const NamedTransform& tool : tools) {
    out.text(tool.name, kDeviceBytes).number(kTool6d).number(std::uint8_t{0});
    put_columns(out, tool.at);
  }
  return std::move(out).sealed("TDATA", device, time_now());
}

SharedBytes points_message(std::string_view device, const std::vector<NamedPoint>& points) {
  constexpr std::uint32_t white = 0xffffffff;
  Writer out;
  for (const NamedPoint& point : points) {
    out.text(point.name, kPointName).text(point.group, kPointGroup).number(white);
    for (std::size_t a = 0; a < 3; ++a)
      out.number(static_cast<float>(kFlip[a]) * point.at[static_cast<Eigen::Index>(a)]);
    out.number(0.0F).text("", kDeviceBytes);
  }
  return std::move(out).sealed("POINT", device, time_now());
}

SharedBytes status_message(std::string_view device, StatusOf code, std::string_view text) {
  Writer out;
  out.number(static_cast<std::uint16_t>(code))
      .number(std::uint64_t{0})
      .text("", 20)
      .text(text, text.size() + 1);
  return std::move(out).sealed("STATUS", device, time_now());
}

SharedBytes capability_message(std::string_view device, std::span<const std::string_view> types) {
  Writer out;
  for (const std::string_view type : types) out.text(type, kTypeBytes);
  return std::move(out).sealed("CAPABILITY", device, time_now());
}

SharedBytes tracking_answer(std::string_view device) {
  Writer out;
  out.number(std::uint8_t{0});
  return std::move(out).sealed("RTS_TDATA", device, time_now());
}

SharedBytes image_message(std::string_view device, const Image& image) {
  const ImageGrid& grid = image.grid;
  for (const std::int32_t size : grid.size) {
    if (size > 65535)
      throw Error(ErrorKind::data, std::string(device), "has more than 65535 voxels along an axis",
                  "make it coarser");
  }
  constexpr std::uint8_t big = 1, little = 2, ras = 1;
  Writer out;
  out.number(std::uint16_t{1})
      .number(static_cast<std::uint8_t>(image.components))
      .number(scalar_code(image.type))
      .number(std::endian::native == std::endian::little ? little : big)
      .number(ras);
  for (const std::int32_t size : grid.size) out.number(static_cast<std::uint16_t>(size));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t row = 0; row < 3; ++row)
      out.number(static_cast<float>(kFlip[row] * grid.direction[3 * row + axis] * grid.spacing[axis]));
  }
  // An image of OpenIGTLink stands where its middle does.
  const std::array<double, 3> middle =
      grid.point((grid.size[0] - 1) / 2.0, (grid.size[1] - 1) / 2.0, (grid.size[2] - 1) / 2.0);
  for (std::size_t row = 0; row < 3; ++row) out.number(static_cast<float>(kFlip[row] * middle[row]));
  for (int axis = 0; axis < 3; ++axis) out.number(std::uint16_t{0});
  for (const std::int32_t size : grid.size) out.number(static_cast<std::uint16_t>(size));
  return std::move(out.raw(image.bytes)).sealed("IMAGE", device, time_now());
}

std::optional<RigidTransform> read_transform(std::span<const std::byte> content) {
  if (content.size() != kTransformBytes) return std::nullopt;
  return transform_of(load_columns(content.data()));
}

std::optional<std::vector<NamedTransform>> read_tracking(std::span<const std::byte> content) {
  if (content.size() % kTrackingBytes != 0) return std::nullopt;
  std::vector<NamedTransform> out;
  for (; !content.empty(); content = content.subspan(kTrackingBytes)) {
    if (const auto at = transform_of(load_columns(content.data() + kTrackingBytes - kTransformBytes)))
      out.push_back({text_of(content.first(kDeviceBytes)), *at});
  }
  return out;
}

std::optional<std::int32_t> read_tracking_request(std::span<const std::byte> content) {
  if (content.size() != kRequestBytes) return std::nullopt;
  return load_big<std::int32_t>(content.data());
}

std::optional<std::vector<NamedPoint>> read_points(std::span<const std::byte> content) {
  if (content.size() % kPointBytes != 0) return std::nullopt;
  std::vector<NamedPoint> out;
  for (; !content.empty(); content = content.subspan(kPointBytes)) {
    NamedPoint& point = out.emplace_back();
    point.name = text_of(content.first(kPointName));
    point.group = text_of(content.subspan(kPointName, kPointGroup));
    for (std::size_t a = 0; a < 3; ++a)
      point.at[static_cast<Eigen::Index>(a)] =
          static_cast<float>(kFlip[a]) *
          load_big<float>(content.data() + kPointName + kPointGroup + 4 + 4 * a);
  }
  return out;
}

std::optional<std::string> read_string(std::span<const std::byte> content) {
  constexpr std::size_t head = 4;
  if (content.size() < head) return std::nullopt;
  const std::size_t length = load_big<std::uint16_t>(content.data() + 2);
  if (length > content.size() - head) return std::nullopt;
  return text_of(content.subspan(head, length));
}

}  // namespace ecorche::app::igtl
