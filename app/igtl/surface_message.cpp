// SPDX-License-Identifier: Apache-2.0
#include "app/igtl/surface_message.hpp"

namespace ecorche::app::igtl {
namespace {

constexpr std::size_t kPolydataHeader = 40, kPointNumbers = 12;  // bytes
constexpr std::uint8_t kNormals = 2;                             // the kind of an attribute

// x, y, z of each vertex, turned from LPS to RAS.
template <class T>
void put_turned(std::span<const T> from, float scale, std::byte* to) {
  for (std::size_t i = 0; i + 2 < from.size(); i += 3, to += kPointNumbers) {
    store_big(-scale * static_cast<float>(from[i]), to);
    store_big(-scale * static_cast<float>(from[i + 1]), to + 4);
    store_big(scale * static_cast<float>(from[i + 2]), to + 8);
  }
}

}  // namespace

SurfaceMessage::SurfaceMessage(std::string device, const Triangles& F, std::size_t vertices)
    : device_(std::move(device)) {
  const auto triangles = static_cast<std::size_t>(F.rows());
  const std::size_t polygon_bytes = triangles * 16;
  const auto vertex_count = static_cast<std::uint32_t>(vertices);
  const std::string name("Normals\0", 8);  // with its zero an even number of bytes: no padding
  points_at_ = kHeaderBytes + kPolydataHeader;
  const std::size_t attributes_at = points_at_ + kPointNumbers * vertices + polygon_bytes;
  normals_at_ = attributes_at + 6 + name.size();
  frame_.resize(normals_at_ + kPointNumbers * vertices);

  // Points, vertices, lines, polygons, strips, attributes: how many, and of those between the bytes.
  std::byte* at = frame_.data() + kHeaderBytes;
  for (const std::uint32_t number : {vertex_count, 0U, 0U, 0U, 0U, static_cast<std::uint32_t>(triangles),
                                     static_cast<std::uint32_t>(polygon_bytes), 0U, 0U, 1U}) {
    store_big(number, at);
    at += 4;
  }
  at = frame_.data() + points_at_ + kPointNumbers * vertices;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    store_big(std::uint32_t{3}, at);
    for (Eigen::Index corner = 0; corner < 3; ++corner) store_big(F(f, corner), at + 4 * (corner + 1));
    at += 16;
  }
  store_big(kNormals, at);
  store_big(std::uint8_t{3}, at + 1);
  store_big(vertex_count, at + 2);
  for (std::size_t i = 0; i < name.size(); ++i) at[6 + i] = static_cast<std::byte>(name[i]);
}

SharedBytes SurfaceMessage::posed(std::span<const float> points, std::span<const std::int16_t> normals,
                                  std::uint64_t time) const {
  Bytes out = frame_;
  put_turned(points, 1.0F, out.data() + points_at_);
  put_turned(normals, 1.0F / 32767, out.data() + normals_at_);
  return seal(std::move(out), "POLYDATA", device_, time);
}

}  // namespace ecorche::app::igtl
