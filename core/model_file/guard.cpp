// SPDX-License-Identifier: Apache-2.0
#include "core/model_file/guard.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "core/model_file/hdf.hpp"
#include "core/model_file/invariants.hpp"
#include "core/model_file/model_file.hpp"

namespace ecorche::model_file {
namespace {

constexpr hsize_t kMaxMembers = 4096;      // of one group: tissues are tens, segments at most hundreds
constexpr std::size_t kMaxText = 1 << 20;  // bytes of one text
constexpr std::array<unsigned char, 8> kMagic{0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
constexpr std::array<std::string_view, 9> kParts{"skeleton", "weights", "cor",        "tissues", "volumes",
                                                 "labels",   "quality", "provenance", "digests"};

// What a member may be, by its place alone: groups nobody knows are not opened.
enum class Expected { nothing, group, dataset };

Expected expected_at(const std::string& group, const std::string& name) {
  const auto among = [&](auto... names) { return ((name == names) || ...); };
  if (group.empty()) return among("VTKHDF", "ecorche") ? Expected::group : Expected::nothing;
  if (group == "/VTKHDF") {
    if (among("CellData", "PointData")) return Expected::group;
    return among("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds", "Points", "Connectivity",
                 "Offsets", "Types")
               ? Expected::dataset
               : Expected::nothing;
  }
  if (group == "/ecorche") {
    if (name == "name") return Expected::dataset;
    return std::find(kParts.begin(), kParts.end(), name) != kParts.end() ? Expected::group
                                                                         : Expected::nothing;
  }
  return group == "/ecorche/tissues" || group == "/ecorche/volumes" ? Expected::group : Expected::dataset;
}

struct Link {
  std::string name;
  H5L_type_t type = H5L_TYPE_ERROR;
};

herr_t collect_link(hid_t, const char* name, const H5L_info_t* info, void* links) {
  try {
    static_cast<std::vector<Link>*>(links)->push_back({name, info->type});
    return 0;
  } catch (...) {  // nothing may be thrown through HDF5
    return -1;
  }
}

class Guard {
 public:
  explicit Guard(const std::filesystem::path& path) : found_{InputFile(path), {}, {}} {
    std::array<unsigned char, 8> magic{};
    if (found_.file.size() >= magic.size()) found_.file.read(0, std::as_writable_bytes(std::span(magic)));
    if (magic != kMagic) refuse("", "is not an HDF5 file");
  }

  Catalogue run() && {
    const hdf::Session session;
    const hdf::Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_fapl_sec2(access);
    H5Pset_file_locking(access, false, true);  // files are replaced by renaming, never changed
    H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
    const hdf::Id file(H5Fopen(found_.file.name().c_str(), H5F_ACC_RDONLY, access), H5Fclose);
    if (!file.good()) refuse("", "cannot be read as HDF5: " + hdf::last_error());
    void* descriptor = nullptr;
    if (H5Fget_vfd_handle(file, access, &descriptor) < 0 || !found_.file.is(*static_cast<int*>(descriptor))) {
      refuse("", "was replaced while it was opened");
    }
    const hdf::Id root(H5Gopen2(file, "/", H5P_DEFAULT), H5Gclose);
    if (!root.good()) refuse("/", "cannot be opened: " + hdf::last_error());
    check_format(root);
    walk(root, "");
    return std::move(found_);
  }

 private:
  [[noreturn]] void refuse(const std::string& path, const std::string& what) const {
    refuse(path, what, "preprocess the case again, or copy the file again");
  }
  [[noreturn]] void refuse(const std::string& path, const std::string& what, const std::string& mend) const {
    throw Error(ErrorKind::data, found_.file.name() + (path.empty() ? "" : ":" + path), what, mend);
  }

  // Attribute `format` of /ecorche: [major, minor], 32-bit.
  void check_format(hid_t root) const {
    H5L_info_t link;
    const hdf::Id ecorche(H5Lget_info(root, "ecorche", &link, H5P_DEFAULT) >= 0 && link.type == H5L_TYPE_HARD
                              ? H5Gopen2(root, "ecorche", H5P_DEFAULT)
                              : H5I_INVALID_HID,
                          H5Gclose);
    if (!ecorche.good()) refuse("/ecorche", "is missing: this is not a model of ecorche");
    const hdf::Id attribute(H5Aopen(ecorche, "format", H5P_DEFAULT), H5Aclose);
    if (!attribute.good()) refuse("/ecorche/format", "is missing: this is not a model of ecorche");
    const hdf::Id type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
    std::array<std::int32_t, 2> format{};
    if (!type.good() || H5Tequal(type, H5T_STD_I32LE) <= 0 || !space.good() || shape_of(space) != Shape{2} ||
        H5Aread(attribute, H5T_STD_I32LE, format.data()) < 0) {
      refuse("/ecorche/format", "is not two 32-bit integers");
    }
    if (format[0] != format_major) {
      refuse("/ecorche/format",
             "is version " + std::to_string(format[0]) + "." + std::to_string(format[1]) +
                 ", this program reads " + std::to_string(format_major) + ".x",
             "preprocess again");
    }
  }

  // Recursion is bounded by `expected_at`: four groups deep, whatever the links say.
  void walk(hid_t group, const std::string& path) {
    found_.groups.insert(path);
    for (const Link& link : links_of(group, path)) {
      const std::string member = path + "/" + link.name;
      if (link.type != H5L_TYPE_HARD) refuse(member, "is a soft or external link");
      switch (expected_at(path, link.name)) {
        case Expected::nothing:
          break;
        case Expected::group: {
          if ((path == "/ecorche/tissues" || path == "/ecorche/volumes") && !is_identifier(link.name)) {
            refuse(member, "is not a name of [a-z0-9_]{1,64}");
          }
          const hdf::Id child(H5Gopen2(group, link.name.c_str(), H5P_DEFAULT), H5Gclose);
          if (!child.good()) refuse(member, "cannot be opened as a group: " + hdf::last_error());
          walk(child, member);
          break;
        }
        case Expected::dataset:
          if (!is_group(group, link.name, member)) inspect_dataset(group, link.name, member);
          break;
      }
    }
  }
  std::vector<Link> links_of(hid_t group, const std::string& path) const {
    H5G_info_t info;
    if (H5Gget_info(group, &info) < 0) refuse(path, "cannot be listed: " + hdf::last_error());
    if (info.nlinks > kMaxMembers) {
      refuse(path,
             "has " + std::to_string(info.nlinks) + " members, more than " + std::to_string(kMaxMembers));
    }
    std::vector<Link> links;
    if (H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, collect_link, &links) < 0) {
      refuse(path, "cannot be listed: " + hdf::last_error());
    }
    return links;
  }
  // A group where this version has a dataset belongs to a newer minor version: left alone.
  bool is_group(hid_t parent, const std::string& name, const std::string& path) const {
    H5O_info_t info;
    if (H5Oget_info_by_name2(parent, name.c_str(), &info, H5O_INFO_BASIC, H5P_DEFAULT) < 0) {
      refuse(path, "cannot be opened: " + hdf::last_error());
    }
    if (info.type != H5O_TYPE_GROUP && info.type != H5O_TYPE_DATASET) refuse(path, "is not a dataset");
    return info.type == H5O_TYPE_GROUP;
  }

  // The order matters: HDF5 may open other files when it is asked for the extent of a virtual dataset.
  void inspect_dataset(hid_t parent, const std::string& name, const std::string& path) {
    const hdf::Id dataset(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose);
    if (!dataset.good()) refuse(path, "cannot be opened: " + hdf::last_error());
    const hdf::Id made(H5Dget_create_plist(dataset), H5Pclose);
    if (!made.good()) refuse(path, "cannot be opened: " + hdf::last_error());
    if (H5Pget_layout(made) != H5D_CONTIGUOUS) refuse(path, "is not stored in one piece");
    if (H5Pget_nfilters(made) != 0) refuse(path, "is filtered");
    if (H5Pget_external_count(made) != 0) refuse(path, "is stored in another file");

    StoredDataset stored;
    const hdf::Id type(H5Dget_type(dataset), H5Tclose);
    if (!type.good() || !known_type(type, stored)) {
      refuse(path, "has a type other than plain little-endian numbers or text of fixed width");
    }
    const hdf::Id space(H5Dget_space(dataset), H5Sclose);
    if (!space.good() || H5Sget_simple_extent_type(space) != H5S_SIMPLE) refuse(path, "has no simple shape");
    stored.shape = shape_of(space);
    stored.bytes = stored.width;
    for (const std::uint64_t extent : stored.shape) {
      if (__builtin_mul_overflow(stored.bytes, extent, &stored.bytes)) refuse_size(path);
    }
    if (stored.bytes > found_.file.size() - total_bytes_) refuse_size(path);
    total_bytes_ += stored.bytes;
    if (stored.bytes > 0) {
      const haddr_t offset = H5Dget_offset(dataset);
      if (offset == HADDR_UNDEF || H5Dget_storage_size(dataset) != stored.bytes) {
        refuse(path, "is not wholly stored");
      }
      if (offset > found_.file.size() - stored.bytes) refuse(path, "reaches beyond the end of its file");
      stored.offset = offset;
    }
    found_.datasets.emplace(path, std::move(stored));
  }
  [[noreturn]] void refuse_size(const std::string& path) const {
    refuse(path, "declares more than its file of " + std::to_string(found_.file.size()) + " bytes can hold");
  }

  using Shape = std::vector<std::uint64_t>;
  static Shape shape_of(hid_t space) {
    std::array<hsize_t, H5S_MAX_RANK> extents{};
    const int rank = H5Sget_simple_extent_dims(space, extents.data(), nullptr);
    return {extents.begin(), extents.begin() + std::max(rank, 0)};
  }
  static bool known_type(hid_t type, StoredDataset& stored) {
    if (H5Tget_class(type) == H5T_STRING) {
      stored.type = ElementType::text;
      stored.width = H5Tget_size(type);
      return H5Tis_variable_str(type) == 0 && H5Tget_strpad(type) == H5T_STR_NULLPAD && stored.width > 0 &&
             stored.width <= kMaxText;
    }
    for (int t = 0; t < static_cast<int>(ElementType::text); ++t) {
      stored.type = static_cast<ElementType>(t);
      stored.width = element_bytes(stored.type);
      if (H5Tequal(type, hdf::file_type(stored.type, stored.width)) > 0) return true;
    }
    return false;
  }

  Catalogue found_;
  std::uint64_t total_bytes_ = 0;  // of all datasets together: two of them may not share their bytes
};

}  // namespace

Catalogue inspect(const std::filesystem::path& path) {
  return Guard(path).run();
}

}  // namespace ecorche::model_file
