// SPDX-License-Identifier: Apache-2.0
// Models spoilt on purpose: valid HDF5, signed again where it helps. Throws std::runtime_error where HDF5
// itself refuses.
#pragma once

#include <xxhash.h>

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/model_file/digest.hpp"
#include "core/model_file/hdf.hpp"

namespace ecorche::test {

using model_file::hdf::Id;

// An existing model, opened to be spoilt.
class Forge {
 public:
  explicit Forge(const std::filesystem::path& path) {
    const Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V110);
    file_ = Id(H5Fopen(path.c_str(), H5F_ACC_RDWR, access), H5Fclose);
    must(file_.good(), path.string());
  }
  hid_t file() const { return file_; }

  void remove(const std::string& path) { must(H5Ldelete(file_, path.c_str(), H5P_DEFAULT) >= 0, path); }
  void group(const std::string& path) {
    const Id group(H5Gcreate2(file_, path.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    must(group.good(), path);
  }
  // Replaces or makes a dataset; `set_up` may ask for chunks, filters, external files.
  Id dataset(const std::string& path, hid_t type, const std::vector<hsize_t>& shape,
             const std::function<void(hid_t)>& set_up = {}) {
    if (H5Lexists(file_, path.c_str(), H5P_DEFAULT) > 0) remove(path);
    const Id space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
    const Id creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    if (set_up) set_up(creation);
    Id made(H5Dcreate2(file_, path.c_str(), type, space, H5P_DEFAULT, creation, H5P_DEFAULT), H5Dclose);
    must(made.good(), path);
    return made;
  }
  // Changes the contents of a dataset in place and signs them again.
  template <class T>
  void edit(const std::string& path, hid_t type, const std::function<void(std::vector<T>&)>& change) {
    const Id dataset(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
    std::vector<T> values(H5Dget_storage_size(dataset) / sizeof(T));
    must(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0, path);
    change(values);
    must(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0, path);
    Table rows = table();
    for (auto& [name, digest] : rows) {
      if (name == path) digest = XXH64(values.data(), values.size() * sizeof(T), 0);
    }
    set_table(rows);
  }

  // The contents page: paths and digests.
  using Table = std::vector<std::pair<std::string, std::uint64_t>>;
  Table table() const {
    const Id names(H5Dopen2(file_, "/ecorche/digests/dataset", H5P_DEFAULT), H5Dclose);
    const Id type(H5Dget_type(names), H5Tclose);
    const std::size_t width = H5Tget_size(type);
    std::string text(H5Dget_storage_size(names), '\0');
    H5Dread(names, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data());
    const Id values(H5Dopen2(file_, "/ecorche/digests/xxh64", H5P_DEFAULT), H5Dclose);
    std::vector<std::uint64_t> digests(text.size() / width);
    H5Dread(values, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, digests.data());
    Table rows;
    for (std::size_t i = 0; i < digests.size(); ++i) {
      rows.emplace_back(text.substr(i * width, width).c_str(), digests[i]);
    }
    return rows;
  }
  void set_table(const Table& rows) {
    constexpr std::size_t width = 128;
    std::string text(rows.size() * width, '\0');
    std::vector<std::uint64_t> digests;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows[i].first.copy(text.data() + i * width, width);
      digests.push_back(rows[i].second);
    }
    const Id type = model_file::hdf::file_type(model_file::ElementType::text, width);
    const Id names = dataset("/ecorche/digests/dataset", type, {rows.size()});
    H5Dwrite(names, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data());
    const Id values = dataset("/ecorche/digests/xxh64", H5T_STD_U64LE, {rows.size()});
    H5Dwrite(values, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, digests.data());
    const Id own = dataset("/ecorche/digests/own", H5T_STD_U64LE, {1});
    const std::uint64_t of_page =
        model_file::contents_digest(std::as_bytes(std::span(text)), std::as_bytes(std::span(digests)));
    H5Dwrite(own, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &of_page);
  }
  // Names a dataset in the contents page.
  void enlist(const std::string& path) {
    Table rows = table();
    rows.emplace_back(path, 0);
    set_table(rows);
  }

 private:
  static void must(bool good, const std::string& path) {
    if (!good) throw std::runtime_error(path + ": HDF5 refuses");
  }

  Id file_;
};

}  // namespace ecorche::test
