// SPDX-License-Identifier: Apache-2.0
#include <ecorche/values/image.hpp>

#include <algorithm>
#include <type_traits>
#include <unordered_set>

#include <ecorche/values/error.hpp>

namespace ecorche {

std::array<double, 3> ImageGrid::point(double i, double j, double k) const {
  const std::array<double, 3> step{spacing[0] * i, spacing[1] * j, spacing[2] * k};
  std::array<double, 3> p = origin;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) p[r] += direction[3 * r + c] * step[c];
  }
  return p;
}

std::array<double, 3> ImageGrid::index(const std::array<double, 3>& point) const {
  std::array<double, 3> index{0, 0, 0};
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t r = 0; r < 3; ++r) index[c] += direction[3 * r + c] * (point[r] - origin[r]);
    index[c] /= spacing[c];
  }
  return index;
}

std::size_t scalar_bytes(ScalarType type) {
  return with_scalar_type(type, [](auto t) { return sizeof t; });
}

std::string_view scalar_name(ScalarType type) {
  switch (type) {
    case ScalarType::u8:
      return "u8";
    case ScalarType::i8:
      return "i8";
    case ScalarType::u16:
      return "u16";
    case ScalarType::i16:
      return "i16";
    case ScalarType::u32:
      return "u32";
    case ScalarType::i32:
      return "i32";
    case ScalarType::f32:
      return "f32";
    case ScalarType::f64:
      break;
  }
  return "f64";
}

void Image::check_type(ScalarType asked) const {
  if (asked != type) {
    throw Error(
        ErrorKind::internal, "image",
        "scalars are " + std::string(scalar_name(type)) + ", asked as " + std::string(scalar_name(asked)),
        "report this");
  }
}

namespace {

template <class T>
std::vector<std::int64_t> distinct(std::span<const T> voxels, std::size_t most) {
  std::vector<std::int64_t> values;
  if constexpr (sizeof(T) <= 2) {
    std::vector<char> seen(65536, 0);
    for (const T v : voxels) seen[static_cast<std::uint16_t>(v)] = 1;
    for (std::size_t bits = 0; bits < seen.size(); ++bits) {
      if (seen[bits] != 0) values.push_back(static_cast<T>(bits));
    }
  } else {
    std::unordered_set<std::int64_t> seen;
    T last{};
    for (const T v : voxels) {
      if (v == last && !seen.empty()) continue;
      last = v;
      seen.insert(static_cast<std::int64_t>(v));
      if (seen.size() > most) break;
    }
    values.assign(seen.begin(), seen.end());
  }
  std::sort(values.begin(), values.end());
  return values;
}

}  // namespace

std::vector<std::int64_t> distinct_values(const Image& image, std::size_t most) {
  if (image.type == ScalarType::f32 || image.type == ScalarType::f64)
    throw Error(ErrorKind::internal, "image", "its voxels are no whole numbers", "report this");
  return with_scalar_type(image.type, [&](auto zero) {
    using T = decltype(zero);
    if constexpr (std::is_integral_v<T>) {
      return distinct(image.scalars<T>(), most);
    } else {
      return std::vector<std::int64_t>();
    }
  });
}

}  // namespace ecorche
