// SPDX-License-Identifier: Apache-2.0
// Datasets of an inspected file, read straight into their final place with their digests checked on the way.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <functional>
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
    return values<T>(path, find(path, element_type_of<T>, shape));
  }
  /// All of a dataset, whatever its type and shape. It grows by blocks: what is read finds the zeros that it
  /// replaces in the cache.
  template <class T>
  std::vector<T> values(const std::string& path, const StoredDataset& dataset) const {
    std::vector<T> out;
    out.reserve(dataset.bytes / sizeof(T));
    platform::advise_huge_pages(out.data(), dataset.bytes);
    read_blocks(path, dataset, [&](std::uint64_t at, std::uint64_t size) {
      out.resize((at + size) / sizeof(T));
      return std::as_writable_bytes(std::span(out)).subspan(at, size);
    });
    return out;
  }
  /// Reads a column without keeping it: `each(row, values)` for runs of rows, before the digest is checked.
  template <class T, class Each>
  void scan(const std::string& path, const Shape& shape, Each&& each) const {
    const StoredDataset& dataset = find(path, element_type_of<T>, shape);
    std::vector<T> passing(std::min(block, dataset.bytes) / sizeof(T));
    const auto room = [&](std::uint64_t, std::uint64_t size) {
      return std::as_writable_bytes(std::span(passing)).first(size);
    };
    read_blocks(path, dataset, room, [&](std::uint64_t at, std::uint64_t size) {
      each(at / sizeof(T), std::span<const T>(passing).first(size / sizeof(T)));
    });
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
  std::vector<std::string> texts(const std::string& path, const Shape& shape = {any}) const;
  std::string text(const std::string& path) const { return texts(path, {1}).front(); }

  /// Throws Error{data} at `path`.
  [[noreturn]] void refuse(const std::string& path, const std::string& what) const;

  /// Compares the stored digest without keeping the bytes.
  bool digest_is_good(const std::string& path) const;

 private:
  // A power of two, and so small that hashing finds in the cache what reading has just brought.
  static constexpr std::uint64_t block = 1 << 18;
  using Room = std::function<std::span<std::byte>(std::uint64_t at, std::uint64_t size)>;
  using Seen = std::function<void(std::uint64_t at, std::uint64_t size)>;

  // Block by block into the room that is given for each. Throws Error{data} where the digest differs.
  void read_blocks(const std::string& path, const StoredDataset& dataset, const Room& room,
                   const Seen& seen = {}) const;
  std::uint64_t digest_of(const StoredDataset& dataset, const Room& room, const Seen& seen) const;

  const Catalogue& catalogue_;
  const Context& context_;
  std::uint64_t total_bytes_ = 0;
  mutable std::mutex mutex_;
  mutable std::uint64_t read_bytes_ = 0;  // for the progress
};

}  // namespace ecorche::model_file
