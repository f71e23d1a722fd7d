// SPDX-License-Identifier: Apache-2.0
#include "io/surface/gltf_accessor.hpp"

#include <algorithm>

#include "io/surface/byte_reader.hpp"

namespace ecorche::io::gltf {
namespace {

using bytes::refuse;
using bytes::Scalar;

Scalar scalar_from(int type, const std::string& where) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return Scalar::i8;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return Scalar::u8;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return Scalar::i16;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return Scalar::u16;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return Scalar::u32;
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return Scalar::f32;
    default:
      refuse(where, "an accessor is of component type " + std::to_string(type));
  }
}

// Rows of `row` bytes in a buffer view, every one inside its buffer.
class Rows {
 public:
  Rows(const tinygltf::Model& model, int view_number, std::size_t offset, std::size_t row, std::size_t count,
       const std::string& where) {
    if (view_number < 0 || static_cast<std::size_t>(view_number) >= model.bufferViews.size())
      refuse(where, "an accessor names buffer view " + std::to_string(view_number) + " of " +
                        std::to_string(model.bufferViews.size()));
    const tinygltf::BufferView& view = model.bufferViews[static_cast<std::size_t>(view_number)];
    if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model.buffers.size())
      refuse(where, "a buffer view names buffer " + std::to_string(view.buffer) + " of " +
                        std::to_string(model.buffers.size()));
    const auto& buffer = model.buffers[static_cast<std::size_t>(view.buffer)].data;
    stride_ = view.byteStride == 0 ? row : view.byteStride;
    const bool inside =
        view.byteOffset <= buffer.size() && view.byteLength <= buffer.size() - view.byteOffset &&
        stride_ >= row && offset <= view.byteLength &&
        (count == 0 ||
         (row <= view.byteLength - offset && (count - 1) <= (view.byteLength - offset - row) / stride_));
    if (!inside) refuse(where, "an accessor of " + std::to_string(count) + " rows lies outside its buffer");
    at_ = reinterpret_cast<const char*>(buffer.data()) + view.byteOffset + offset;
  }
  const char* row(std::size_t i) const { return at_ + i * stride_; }

 private:
  const char* at_ = nullptr;
  std::size_t stride_ = 0;
};

double real_of(const char* from, Scalar type, bool normalized) {
  const double value = bytes::load_real(from, type, false);
  if (!normalized || type == Scalar::f32) return value;
  constexpr double largest[] = {127, 255, 32767, 65535, 2147483647, 4294967295};
  return std::max(value / largest[static_cast<std::size_t>(type)], -1.0);
}

// Reads all rows by `load(from, type)`, then writes the sparse ones over them.
template <class T, class Load>
std::vector<T> values(const tinygltf::Model& model, int number, int components, files::Budget& budget,
                      Load&& load) {
  const std::string& where = budget.where();
  if (number < 0 || static_cast<std::size_t>(number) >= model.accessors.size())
    refuse(where, "a mesh names accessor " + std::to_string(number) + " of " +
                      std::to_string(model.accessors.size()));
  const tinygltf::Accessor& accessor = model.accessors[static_cast<std::size_t>(number)];
  if (tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)) != components)
    refuse(where, "an accessor has not " + std::to_string(components) + " values a row");
  const Scalar type = scalar_from(accessor.componentType, where);
  const std::size_t size = bytes::size_of(type), columns = static_cast<std::size_t>(components);
  const auto& sparse = accessor.sparse;
  if (accessor.bufferView < 0 && !sparse.isSparse)
    refuse(where, "an accessor has no buffer view: its geometry is compressed",
           "save it without compression");
  std::vector<T> out;
  const auto read = [&](const Rows& rows, std::size_t from, std::size_t to) {
    for (std::size_t c = 0; c < columns; ++c)
      out[to * columns + c] = load(rows.row(from) + c * size, type, accessor.normalized);
  };
  if (accessor.bufferView >= 0) {
    const Rows rows(model, accessor.bufferView, accessor.byteOffset, size * columns, accessor.count, where);
    budget.spend(accessor.count, columns * sizeof(T));
    out.resize(accessor.count * columns);
    for (std::size_t i = 0; i < accessor.count; ++i) read(rows, i, i);
  } else {
    // Zeros, for which no byte of the file stands.
    budget.spend(accessor.count, columns * sizeof(T));
    out.resize(accessor.count * columns);
  }
  if (!sparse.isSparse) return out;
  const Scalar index_type = scalar_from(sparse.indices.componentType, where);
  if (sparse.count < 0 || sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0 ||
      bytes::is_real(index_type))
    refuse(where, "a sparse accessor is damaged");
  const auto count = static_cast<std::size_t>(sparse.count);
  const Rows indices(model, sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset),
                     bytes::size_of(index_type), count, where);
  const Rows rows(model, sparse.values.bufferView, static_cast<std::size_t>(sparse.values.byteOffset),
                  size * columns, count, where);
  for (std::size_t i = 0; i < count; ++i) {
    const std::int64_t to = bytes::load_whole(indices.row(i), index_type, false);
    if (to < 0 || static_cast<std::size_t>(to) >= accessor.count)
      refuse(where, "a sparse accessor is damaged");
    read(rows, i, static_cast<std::size_t>(to));
  }
  return out;
}

}  // namespace

std::vector<double> reals(const tinygltf::Model& model, int number, int components, files::Budget& budget) {
  return values<double>(model, number, components, budget, real_of);
}

std::vector<std::int64_t> wholes(const tinygltf::Model& model, int number, files::Budget& budget) {
  return values<std::int64_t>(model, number, 1, budget, [&](const char* from, Scalar type, bool) {
    if (bytes::is_real(type)) refuse(budget.where(), "its indices are no whole numbers");
    return bytes::load_whole(from, type, false);
  });
}

}  // namespace ecorche::io::gltf
