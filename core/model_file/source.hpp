// SPDX-License-Identifier: Apache-2.0
// Datasets of an inspected file, read straight into their final place with their digests checked on the way.
#pragma once

#include <Eigen/Core>
#include <mutex>
#include <string>
#include <vector>

#include <ecorche/values/context.hpp>
#include "core/model_file/guard.hpp"
#include "core/platform/huge_pages.hpp"

namespace ecorche::model_file {

/// Any number of threads may read from one.
class Source {
 public:
  using Shape = std::vector<std::uint64_t>;
  /// Any extent, in a shape that is asked for.
  static constexpr std::uint64_t any = ~std::uint64_t{0};

  /// `context` and `catalogue` must outlive the source.
  Source(const Catalogue& catalogue, const Context& context);

  const Catalogue& catalogue() const { return catalogue_; }
  /// Names of the groups in `group`, in the order of their `index` datasets, which must count 0, 1, 2, ...
  std::vector<std::string> ordered_members(const std::string& group) const;

  /// The dataset, when it has this type and shape. Throws Error{data}.
  const StoredDataset& find(const std::string& path, ElementType type, const Shape& shape) const;
  /// The dataset of whatever type and shape. Throws Error{data}.
  const StoredDataset& find(const std::string& path) const;

  /// Fills `out`. Throws Error{data} where the digest differs.
  void read(const std::string& path, const StoredDataset& dataset, std::span<std::byte> out) const;

  template <class T>
  std::vector<T> vector(const std::string& path, Shape shape = {any}) const {
    const StoredDataset& dataset = find(path, element_type_of<T>, shape);
    std::vector<T> values = room<T>(dataset.bytes / sizeof(T));
    read(path, dataset, std::as_writable_bytes(std::span(values)));
    return values;
  }
  /// So many zeros, to be read into.
  template <class T>
  static std::vector<T> room(std::size_t count) {
    std::vector<T> values;
    values.reserve(count);
    platform::advise_huge_pages(values.data(), count * sizeof(T));
    values.resize(count);
    return values;
  }
  template <class T>
  T scalar(const std::string& path) const {
    return vector<T>(path, {1}).front();
  }
  /// Rows of a row-major matrix with a fixed number of columns; a flat dataset is cut into rows.
  template <class M>
  M matrix(const std::string& path, bool flat = false) const {
    constexpr auto columns = static_cast<std::uint64_t>(M::ColsAtCompileTime);
    const StoredDataset& dataset =
        find(path, element_type_of<typename M::Scalar>, flat ? Shape{any} : Shape{any, columns});
    if (flat && dataset.shape[0] % columns != 0) refuse(path, "does not fill its last row");
    M values(static_cast<Eigen::Index>(dataset.bytes / sizeof(typename M::Scalar) / columns), columns);
    platform::advise_huge_pages(values.data(), dataset.bytes);
    read(path, dataset,
         std::as_writable_bytes(std::span(values.data(), static_cast<std::size_t>(values.size()))));
    return values;
  }
  std::vector<std::string> texts(const std::string& path, Shape shape = {any}) const;
  std::string text(const std::string& path) const { return texts(path, {1}).front(); }

  /// Throws Error{data} at `path`.
  [[noreturn]] void refuse(const std::string& path, const std::string& what) const;

  /// Compares the stored digest without keeping the bytes.
  bool digest_is_good(const std::string& path) const;

 private:
  std::uint64_t read_and_digest(const StoredDataset& dataset, std::span<std::byte> out) const;

  const Catalogue& catalogue_;
  const Context& context_;
  std::uint64_t total_bytes_ = 0;
  mutable std::mutex mutex_;
  mutable std::uint64_t read_bytes_ = 0;  // for the progress
};

}  // namespace ecorche::model_file
