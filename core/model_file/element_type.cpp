// SPDX-License-Identifier: Apache-2.0
#include "core/model_file/element_type.hpp"

#include <array>

namespace ecorche::model_file {
namespace {

struct Row {
  std::string_view name;
  std::size_t bytes;
};
constexpr std::array<Row, 11> kRows{{{"u8", 1},
                                     {"i8", 1},
                                     {"u16", 2},
                                     {"i16", 2},
                                     {"u32", 4},
                                     {"i32", 4},
                                     {"u64", 8},
                                     {"i64", 8},
                                     {"f32", 4},
                                     {"f64", 8},
                                     {"text", 0}}};

}  // namespace

std::size_t element_bytes(ElementType type) {
  return kRows[static_cast<std::size_t>(type)].bytes;
}

std::string_view element_name(ElementType type) {
  return kRows[static_cast<std::size_t>(type)].name;
}

ElementType element_type(ScalarType type) {
  return with_scalar_type(type, [](auto scalar) { return element_type_of<decltype(scalar)>; });
}

}  // namespace ecorche::model_file
