// SPDX-License-Identifier: Apache-2.0
#include "core/model_file/guard.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include <ecorche/model_file/model_file.hpp>
#include "core/model_file/digest.hpp"
#include "core/model_file/hdf.hpp"
#include "core/model_file/invariants.hpp"
#include "core/values/identifier.hpp"

namespace ecorche::model_file {
namespace {

constexpr hsize_t kMaxMembers = 4096;      // of one group: tissues are tens, segments at most hundreds
constexpr std::size_t kMaxText = 1 << 20;  // bytes of one text
constexpr std::array<unsigned char, 8> kMagic{0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
constexpr std::array<std::string_view, 9> kParts{
    "skeleton", "weights", "cor", "labels", "materials", "quality", "safe_range", "provenance", "digests"};
// Groups of groups, a name each.
constexpr std::array<std::string_view, 7> kNamedParts{"tissues",
                                                      "volumes",
                                                      "spheres",
                                                      "correction",
                                                      "pose_correction",
                                                      "packed_correction",
                                                      "packed_pose_correction"};

// Whether this version knows the group; datasets in other groups belong to a newer minor version.
bool known_group(const std::string& path) {
  if (path == "/VTKHDF" || path == "/VTKHDF/CellData" || path == "/VTKHDF/PointData" || path == "/ecorche")
    return true;
  for (const std::string_view part : kParts)
    if (path == "/ecorche/" + std::string(part)) return true;
  for (const std::string_view part : kNamedParts) {
    const std::string group = "/ecorche/" + std::string(part) + "/";
    if (path.starts_with(group) && is_identifier(path.substr(group.size()))) return true;
  }
  return false;
}

class Guard {
 public:
  explicit Guard(const std::filesystem::path& path) : found_{InputFile(path), {}, {}} {
    std::array<unsigned char, 8> magic{};
    if (found_.file.size() >= magic.size()) found_.file.read(0, std::as_writable_bytes(std::span(magic)));
    if (magic != kMagic)
      refuse("", "is not an HDF5 file",
             "a model is what ecorche preprocess writes; copy it again if this was one");
  }

  Catalogue run() && {
    const hdf::Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_fapl_sec2(access);
    H5Pset_file_locking(access, false, true);  // files are replaced by renaming, never changed
    H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
    file_ = hdf::Id(H5Fopen(found_.file.name().c_str(), H5F_ACC_RDONLY, access), H5Fclose);
    if (!file_.good()) refuse("", "cannot be read as HDF5: " + hdf::last_error());
    void* descriptor = nullptr;
    if (H5Fget_vfd_handle(file_, access, &descriptor) < 0 ||
        !found_.file.is(*static_cast<int*>(descriptor))) {
      refuse("", "was replaced while it was opened");
    }
    groups_.emplace("", hdf::Id(H5Gopen2(file_, "/", H5P_DEFAULT), H5Gclose));
    check_group(groups_.at(""), "/");
    check_format();
    for (const char* always : {"/ecorche/tissues", "/ecorche/volumes"}) group_at(always);
    inspect_listed();
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
  void check_format() {
    if (H5Lexists(groups_.at(""), "ecorche", H5P_DEFAULT) <= 0) {
      refuse("/ecorche", "is missing: this is not a model of ecorche");
    }
    const hdf::Id attribute(H5Aopen(group_at("/ecorche"), "format", H5P_DEFAULT), H5Aclose);
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
    found_.minor = format[1];
  }

  // The contents page first, itself two datasets: paths, and the XXH64 of what they name.
  void inspect_listed() {
    const std::string names = "/ecorche/digests/dataset", values = "/ecorche/digests/xxh64";
    const StoredDataset& paths = inspect_dataset(names);
    const StoredDataset& digests = inspect_dataset(values);
    if (paths.type != ElementType::text || paths.shape.size() != 1) refuse(names, "is not a list of text");
    const std::uint64_t count = paths.shape[0];
    if (digests.type != ElementType::u64 || digests.shape != paths.shape) {
      refuse(values, "is not one u64 per dataset");
    }
    std::string text(paths.bytes, '\0');
    std::vector<std::uint64_t> digest(count);
    found_.file.read(paths.offset, std::as_writable_bytes(std::span(text)));
    found_.file.read(digests.offset, std::as_writable_bytes(std::span(digest)));
    check_contents(text, digest);
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::string_view padded = std::string_view(text).substr(i * paths.width, paths.width);
      const std::string path(padded.substr(0, padded.find('\0')));
      if (!known_group(path.substr(0, path.rfind('/')))) continue;
      if (found_.datasets.contains(path)) refuse(names, "names " + path + " twice");
      inspect_dataset(path).digest = digest[i];
    }
  }

  // A path of the contents page that was damaged may name a group that nobody knows, and is then passed over
  // with what it stood for. Older models have no digest of the page; that one is there is said by the group's
  // header, which HDF5 guards.
  void check_contents(const std::string& text, const std::vector<std::uint64_t>& digest) {
    const std::string own = "/ecorche/digests/own";
    if (H5Lexists(group_at("/ecorche/digests"), "own", H5P_DEFAULT) <= 0) return;
    const StoredDataset& stored = inspect_dataset(own);
    if (stored.type != ElementType::u64 || stored.shape != Shape{1}) refuse(own, "is not one u64");
    std::uint64_t wanted = 0;
    found_.file.read(stored.offset, std::as_writable_bytes(std::span(&wanted, 1)));
    if (contents_digest(std::as_bytes(std::span(text)), std::as_bytes(std::span(digest))) != wanted)
      refuse("/ecorche/digests", "is damaged: its XXH64 is not the stored one");
  }

  // Every link on the way must be hard. Only known groups are asked for, so the way is at most three long.
  const hdf::Id& group_at(const std::string& path) {
    const auto known = groups_.find(path);
    if (known != groups_.end()) return known->second;
    const std::size_t slash = path.rfind('/');
    const hdf::Id& parent = group_at(path.substr(0, slash));
    check_link(parent, path.c_str() + slash + 1, path);
    hdf::Id group(H5Gopen2(parent, path.c_str() + slash + 1, H5P_DEFAULT), H5Gclose);
    if (!group.good()) refuse(path, "cannot be opened as a group: " + hdf::last_error());
    check_group(group, path);
    found_.groups.insert(path);
    return groups_.emplace(path, std::move(group)).first->second;
  }
  void check_link(hid_t group, const char* name, const std::string& path) const {
    H5L_info_t link;
    if (H5Lexists(group, name, H5P_DEFAULT) <= 0 || H5Lget_info(group, name, &link, H5P_DEFAULT) < 0)
      refuse(path, "is missing");
    if (link.type != H5L_TYPE_HARD) refuse(path, "is a soft or external link");
  }
  void check_group(hid_t group, const std::string& path) const {
    H5G_info_t info{};
    const bool known = H5Gget_info(group, &info) >= 0;
    if (known && info.nlinks > kMaxMembers) {
      refuse(path,
             "has " + std::to_string(info.nlinks) + " members, more than " + std::to_string(kMaxMembers));
    }
    if (!known || info.storage_type != H5G_STORAGE_TYPE_COMPACT) {
      refuse(path, "keeps its links outside of its header: this is not a model of ecorche");
    }
  }

  // The order matters: HDF5 may open other files when it is asked for the extent of a virtual dataset.
  StoredDataset& inspect_dataset(const std::string& path) {
    const std::size_t slash = path.rfind('/');
    const hdf::Id& group = group_at(path.substr(0, slash));
    const char* name = path.c_str() + slash + 1;
    check_link(group, name, path);
    const hdf::Id dataset(H5Dopen2(group, name, H5P_DEFAULT), H5Dclose);
    const hdf::Id made(dataset.good() ? H5Dget_create_plist(dataset) : H5I_INVALID_HID, H5Pclose);
    if (!made.good()) refuse(path, "cannot be opened as a dataset: " + hdf::last_error());
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
      if (offset == HADDR_UNDEF || H5Dget_storage_size(dataset) != stored.bytes ||
          offset > found_.file.size() - stored.bytes) {
        refuse(path, "is not wholly stored");
      }
      stored.offset = offset;
    }
    return found_.datasets.emplace(path, std::move(stored)).first->second;
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

  const hdf::Session session_;  // first in, last out
  Catalogue found_;
  hdf::Id file_;
  std::map<std::string, hdf::Id> groups_;  // open, by path
  std::uint64_t total_bytes_ = 0;          // of all datasets together: two of them may not share their bytes
};

}  // namespace

Catalogue inspect(const std::filesystem::path& path) {
  return Guard(path).run();
}

}  // namespace ecorche::model_file
