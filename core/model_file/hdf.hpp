// SPDX-License-Identifier: Apache-2.0
// The little of HDF5's C API that the guard and the writer need: owned identifiers, a quiet session, types.
#pragma once

#include <hdf5.h>

#include <mutex>
#include <string>
#include <utility>

#include "core/model_file/element_type.hpp"

namespace ecorche::model_file::hdf {

/// Holds the library while it is in use (not every build of HDF5 is thread-safe) and keeps it from printing.
class Session {
 public:
  Session();
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

 private:
  std::unique_lock<std::mutex> lock_;
  H5E_auto2_t print_ = nullptr;
  void* print_data_ = nullptr;
};

/// One owned HDF5 identifier.
class Id {
 public:
  using Close = herr_t (*)(hid_t);

  Id() = default;
  Id(hid_t id, Close closer) : id_(id), close_(closer) {}
  Id(Id&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Id& operator=(Id&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Id() { close(); }

  bool good() const { return id_ >= 0; }
  operator hid_t() const { return id_; }  // NOLINT: the C API takes it everywhere
  /// False when HDF5 could not finish what it had to do; the identifier is gone either way.
  bool close() { return id_ < 0 || close_(std::exchange(id_, H5I_INVALID_HID)) >= 0; }

 private:
  hid_t id_ = H5I_INVALID_HID;
  Close close_ = nullptr;
};

/// The innermost line of HDF5's error stack: `unable to open file: ...`, or a plain word when it is empty.
std::string last_error();

/// The type in the file of `type`; text has `width` bytes, padded with NUL, UTF-8.
Id file_type(ElementType type, std::size_t width);

}  // namespace ecorche::model_file::hdf
