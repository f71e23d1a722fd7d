// SPDX-License-Identifier: Apache-2.0
#include "core/model_file/hdf.hpp"

#include <ecorche/model_file/model_file.hpp>

namespace ecorche::model_file {

void leave_hdf5_open_at_exit() {
  H5dont_atexit();
}

}  // namespace ecorche::model_file

namespace ecorche::model_file::hdf {
namespace {

std::mutex& library_mutex() {
  static std::mutex mutex;
  return mutex;
}

herr_t keep_description(unsigned, const H5E_error2_t* error, void* text) {
  static_cast<std::string*>(text)->assign(error->desc != nullptr ? error->desc : "");
  return 1;  // the first visited, which is the innermost, is enough
}

}  // namespace

Session::Session() : lock_(library_mutex()) {
  H5Eget_auto2(H5E_DEFAULT, &print_, &print_data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Session::~Session() {
  H5Eset_auto2(H5E_DEFAULT, print_, print_data_);
}

std::string last_error() {
  std::string text;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_description, &text);
  return text.empty() ? "HDF5 gives no reason" : text;
}

Id file_type(ElementType type, std::size_t width) {
  switch (type) {
    case ElementType::u8:
      return {H5Tcopy(H5T_STD_U8LE), H5Tclose};
    case ElementType::i8:
      return {H5Tcopy(H5T_STD_I8LE), H5Tclose};
    case ElementType::u16:
      return {H5Tcopy(H5T_STD_U16LE), H5Tclose};
    case ElementType::i16:
      return {H5Tcopy(H5T_STD_I16LE), H5Tclose};
    case ElementType::u32:
      return {H5Tcopy(H5T_STD_U32LE), H5Tclose};
    case ElementType::i32:
      return {H5Tcopy(H5T_STD_I32LE), H5Tclose};
    case ElementType::u64:
      return {H5Tcopy(H5T_STD_U64LE), H5Tclose};
    case ElementType::i64:
      return {H5Tcopy(H5T_STD_I64LE), H5Tclose};
    case ElementType::f32:
      return {H5Tcopy(H5T_IEEE_F32LE), H5Tclose};
    case ElementType::f64:
      return {H5Tcopy(H5T_IEEE_F64LE), H5Tclose};
    case ElementType::text:
      break;
  }
  Id text(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(text, width);
  H5Tset_strpad(text, H5T_STR_NULLPAD);
  H5Tset_cset(text, H5T_CSET_UTF8);
  return text;
}

}  // namespace ecorche::model_file::hdf
