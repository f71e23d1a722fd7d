// SPDX-License-Identifier: Apache-2.0
// Values as bytes: written, read back, or only hashed, by one list of fields each (fields.hpp).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/model_file/digest.hpp"

namespace ecorche::preprocess::cache {

/// What a kept stage does not hold: it was cut, or was written by another program. Never leaves the cache.
struct Misread {};

template <class T>
concept Plain = std::is_arithmetic_v<T> || std::is_enum_v<T>;

/// Feeds numbers, text, arrays and what fields.hpp names to `Sink::bytes(span)`, little-endian, lengths as
/// u64 before their elements.
template <class Sink>
class Out {
 public:
  template <class... T>
  void operator()(const T&... values) {
    (put(values), ...);
  }

 private:
  void raw(std::span<const std::byte> bytes) { static_cast<Sink*>(this)->bytes(bytes); }
  void length(std::size_t n) { put(std::uint64_t{n}); }

  template <Plain T>
  void put(T value) {
    raw(std::as_bytes(std::span(&value, 1)));
  }
  void put(std::string_view text) {
    length(text.size());
    raw(std::as_bytes(std::span(text)));
  }
  void put(const std::string& text) { put(std::string_view(text)); }
  template <class T>
  void put(const std::vector<T>& values) {
    length(values.size());
    if constexpr (std::is_trivially_copyable_v<T>) {
      raw(std::as_bytes(std::span(values)));
    } else {
      for (const T& value : values) put(value);
    }
  }
  template <class T, std::size_t N>
  void put(const std::array<T, N>& values) {
    for (const T& value : values) put(value);
  }
  template <class T, int Columns>
  void put(const Eigen::Matrix<T, Eigen::Dynamic, Columns, Eigen::RowMajor>& rows) {
    length(static_cast<std::size_t>(rows.rows()));
    raw(std::as_bytes(std::span(rows.data(), static_cast<std::size_t>(rows.size()))));
  }
  template <class T, int Rows, int Columns>
  requires(Rows > 0 && Columns > 0) void put(const Eigen::Matrix<T, Rows, Columns>& values) {
    raw(std::as_bytes(std::span(values.data(), static_cast<std::size_t>(values.size()))));
  }
  template <class A, class B>
  void put(const std::pair<A, B>& two) {
    put(two.first);
    put(two.second);
  }
  template <class T>
  void put(const std::shared_ptr<const T>& shared) {
    put(shared != nullptr);
    if (shared) put(*shared);
  }
  template <class K, class V>
  void put(const std::map<K, V>& entries) {
    length(entries.size());
    for (const auto& [key, value] : entries) {
      put(key);
      put(value);
    }
  }
  template <class T>
  requires requires(Sink& sink, const T& value) { fields(sink, value); }
  void put(const T& value) { fields(static_cast<Sink&>(*this), value); }
};

/// XXH64 of everything that it is given.
class Hasher : public Out<Hasher> {
 public:
  void bytes(std::span<const std::byte> bytes) { digest_.bytes(bytes); }
  std::uint64_t value() const { return digest_.value(); }

 private:
  model_file::Digest digest_;
};

/// Bytes in memory.
class Packer : public Out<Packer> {
 public:
  void bytes(std::span<const std::byte> bytes) {
    packed_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  std::string take() { return std::move(packed_); }

 private:
  std::string packed_;
};

/// Reads what a Packer wrote, in the same order. Throws Misread where the bytes end early or a length says
/// more than there are; `done()` tells whether all were read.
class Unpacker {
 public:
  explicit Unpacker(std::string_view packed) : left_(packed) {}

  template <class... T>
  void operator()(T&... values) {
    (get(values), ...);
  }
  bool done() const { return left_.empty(); }

 private:
  void raw(void* to, std::size_t bytes) {
    if (bytes > left_.size()) throw Misread{};
    if (bytes > 0) std::memcpy(to, left_.data(), bytes);
    left_.remove_prefix(bytes);
  }
  // A count of elements of at least `least` bytes each, all of which are there.
  std::size_t length(std::size_t least) {
    std::uint64_t n = 0;
    raw(&n, sizeof n);
    if (n > left_.size() / least) throw Misread{};
    return n;
  }

  template <Plain T>
  void get(T& value) {
    raw(&value, sizeof value);
  }
  void get(std::string& text) {
    text.resize(length(1));
    raw(text.data(), text.size());
  }
  template <class T>
  void get(std::vector<T>& values) {
    if constexpr (std::is_trivially_copyable_v<T>) {
      values.resize(length(sizeof(T)));
      raw(values.data(), values.size() * sizeof(T));
    } else {
      values.resize(length(1));
      for (T& value : values) get(value);
    }
  }
  template <class T, std::size_t N>
  void get(std::array<T, N>& values) {
    for (T& value : values) get(value);
  }
  template <class T, int Columns>
  void get(Eigen::Matrix<T, Eigen::Dynamic, Columns, Eigen::RowMajor>& rows) {
    rows.resize(static_cast<Eigen::Index>(length(sizeof(T) * Columns)), Columns);
    raw(rows.data(), sizeof(T) * static_cast<std::size_t>(rows.size()));
  }
  template <class T, int Rows, int Columns>
  requires(Rows > 0 && Columns > 0) void get(Eigen::Matrix<T, Rows, Columns>& values) {
    raw(values.data(), sizeof(T) * static_cast<std::size_t>(values.size()));
  }
  template <class T>
  requires requires(Unpacker& unpacker, T& value) { fields(unpacker, value); }
  void get(T& value) { fields(*this, value); }

  std::string_view left_;
};

}  // namespace ecorche::preprocess::cache
