// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstring>

#include <ecorche/model_file/model_file.hpp>
#include "core/files/atomic_file.hpp"
#include "core/model_file/digest.hpp"
#include "core/model_file/hdf.hpp"
#include "core/model_file/in_turn.hpp"
#include "core/model_file/invariants.hpp"
#include "core/model_file/layout.hpp"
#include "core/platform/file.hpp"

namespace ecorche::model_file {
namespace {

namespace fs = std::filesystem;

// Large datasets begin on a page, so that a loader can map them; small ones stay together.
constexpr hsize_t kAlignFrom = 65536, kAlignment = 4096;

// HDF5 1.10 does not get over a file whose closing fails: it keeps it, and may crash when the process ends.
// So the disk is asked for all the space before HDF5 writes anything, while a full disk is still an ordinary
// error.
void reserve(const fs::path& path, const std::string& shown, std::uint64_t bytes) {
  std::error_code error;
  platform::File file(path, platform::Open::write_or_make, error);
  if (!error) error = file.reserve(0, bytes);
  if (error) {
    throw Error(ErrorKind::io, shown,
                "no room for " + std::to_string(bytes >> 10) + " KiB: " + error.message(),
                "free space on the disk, or name another one");
  }
}

// Bytes that surely suffice for these entries, their headers and their alignment.
std::uint64_t bound(const std::vector<const Entry*>& entries) {
  std::uint64_t bytes = 1 << 16;
  for (const Entry* entry : entries) bytes += entry->bytes.size() + kAlignment + 2 * entry->path.size();
  return bytes;
}

// One HDF5 file being made. The same datasets give the same bytes: no times, no filters, one order. Any
// thread may go on with it; none of it within a Session.
class OutputFile {
 public:
  OutputFile(const fs::path& path, const fs::path& shown, std::uint64_t bytes) : OutputFile(path, shown) {
    // Whatever is thrown from here on, the destructor is called.
    const hdf::Session session;
    reserve(path, shown_, bytes);
    const hdf::Id creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose),
        access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    set_up_group(creation);
    H5Pset_fapl_sec2(access);
    H5Pset_file_locking(access, false, true);  // nobody else knows the temporary name
    H5Pset_alignment(access, kAlignFrom, kAlignment);
    H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V18);  // checksummed headers, read since 1.8
    H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
    file_ = hdf::Id(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation, access), H5Fclose);
    if (!file_.good()) {
      throw Error(ErrorKind::cannot_create, shown_, "cannot be made: " + hdf::last_error(),
                  "check the folder's rights and the disk's free space");
    }
    reserve(path, shown_, bytes);  // again: creating has truncated it
    std::error_code ignored;
    disk_ = platform::File(path, platform::Open::write, ignored);
  }

  ~OutputFile() {
    const hdf::Session session;
    groups_.clear();
    file_.close();
  }
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void make_group(const std::string& path) {
    const hdf::Session session;
    group_at(path);
  }

  void add(const Entry& entry) {
    const hdf::Session session;
    const std::size_t slash = entry.path.rfind('/');
    const hdf::Id& group = group_at(entry.path.substr(0, slash));
    const hdf::Id type = hdf::file_type(entry.type, entry.width);
    const std::vector<hsize_t> shape(entry.shape.begin(), entry.shape.end());
    const hdf::Id space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
    const hdf::Id creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    H5Pset_layout(creation, H5D_CONTIGUOUS);
    H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY);
    H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER);
    H5Pset_obj_track_times(creation, false);
    const hdf::Id dataset(
        H5Dcreate2(group, entry.path.c_str() + slash + 1, type, space, H5P_DEFAULT, creation, H5P_DEFAULT),
        H5Dclose);
    if (!dataset.good()) fail(entry.path);
    if (entry.bytes.empty()) return;
    if (H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, entry.bytes.data()) < 0) fail(entry.path);
    if (entry.bytes.size() >= kAlignFrom) disk_.begin_flush(H5Dget_offset(dataset), entry.bytes.size());
  }

  template <std::size_t N, class T>
  void set_attribute(const std::string& group, const char* name, const std::array<T, N>& values) {
    const hdf::Session session;
    const hsize_t extent = N;
    const hdf::Id space(H5Screate_simple(1, &extent, nullptr), H5Sclose);
    set_attribute(group, name, hdf::file_type(element_type_of<T>, sizeof(T)), space, values.data());
  }
  // ParaView asks for one fixed-length ASCII string.
  void set_attribute(const std::string& group, const char* name, const std::string& ascii) {
    const hdf::Session session;
    const hdf::Id type(H5Tcopy(H5T_C_S1), H5Tclose), space(H5Screate(H5S_SCALAR), H5Sclose);
    H5Tset_size(type, ascii.size());
    H5Tset_strpad(type, H5T_STR_NULLPAD);
    set_attribute(group, name, type, space, ascii.data());
  }

  void close() {
    const hdf::Session session;
    groups_.clear();
    hsize_t size = 0;
    if (H5Fflush(file_, H5F_SCOPE_LOCAL) < 0 || H5Fget_filesize(file_, &size) < 0 || !file_.close()) fail("");
    if (fs::file_size(path_) > size) fs::resize_file(path_, size);  // gives back what was reserved beyond
  }

 private:
  OutputFile(const fs::path& path, const fs::path& shown) : path_(path), shown_(shown.string()) {}

  static void set_up_group(hid_t creation) {
    H5Pset_obj_track_times(creation, false);
    H5Pset_link_phase_change(creation, 0xffff, 0);  // links stay in the group's own, checksummed header
  }
  const hdf::Id& group_at(const std::string& path) {
    const auto known = groups_.find(path);
    if (known != groups_.end()) return known->second;
    if (path.empty()) {
      return groups_.emplace(path, hdf::Id(H5Gopen2(file_, "/", H5P_DEFAULT), H5Gclose)).first->second;
    }
    const std::size_t slash = path.rfind('/');
    const hdf::Id& parent = group_at(path.substr(0, slash));
    const hdf::Id creation(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
    set_up_group(creation);
    hdf::Id group(H5Gcreate2(parent, path.c_str() + slash + 1, H5P_DEFAULT, creation, H5P_DEFAULT), H5Gclose);
    if (!group.good()) fail(path);
    return groups_.emplace(path, std::move(group)).first->second;
  }
  void set_attribute(const std::string& group, const char* name, hid_t type, hid_t space,
                     const void* values) {
    const hdf::Id attribute(H5Acreate2(group_at(group), name, type, space, H5P_DEFAULT, H5P_DEFAULT),
                            H5Aclose);
    if (!attribute.good() || H5Awrite(attribute, type, values) < 0) fail(group + "/" + name);
  }
  [[noreturn]] void fail(const std::string& path) const {
    throw Error(ErrorKind::io, shown_ + (path.empty() ? "" : ":" + path),
                "writing failed: " + hdf::last_error(), "check the disk's free space");
  }

  fs::path path_;
  std::string shown_;
  platform::File disk_;  // the same file
  hdf::Id file_;         // outlives the groups
  std::map<std::string, hdf::Id> groups_;
};

std::vector<std::uint64_t> digests_of(const std::vector<const Entry*>& entries, const Context& context) {
  std::vector<std::uint64_t> out;
  out.reserve(entries.size());
  for (const Entry* entry : entries) {
    context.check_stop();
    out.push_back(Digest().bytes(entry->bytes).value());
  }
  return out;
}

void add_all(const std::vector<const Entry*>& entries, OutputFile& file, const Context& context) {
  std::uint64_t total = 0, done = 0;
  for (const Entry* entry : entries) total += entry->bytes.size();
  for (const Entry* entry : entries) {
    context.check_stop();
    file.add(*entry);
    done += entry->bytes.size();
    context.report(static_cast<double>(done) / static_cast<double>(total));
  }
}

// What the file holds, and its digests.
Layout contents(const std::vector<const Entry*>& entries, const std::vector<std::uint64_t>& digests) {
  std::vector<std::string> paths;
  paths.reserve(entries.size());
  for (const Entry* entry : entries) paths.push_back(entry->path);
  Layout table;
  table.texts("/ecorche/digests/dataset", paths);
  table.copy("/ecorche/digests/xxh64", digests);
  table.scalar("/ecorche/digests/own", contents_digest(table.entries()[0].bytes, table.entries()[1].bytes));
  return table;
}

}  // namespace

void write(const Model& model, const fs::path& path, const Context& context) {
  if (path.extension() != ".hdf") {
    throw Error(ErrorKind::usage, path.string(), "does not end in .hdf, which ParaView asks for",
                "name the model " + path.stem().string() + ".hdf");
  }
  check_invariants(model, path.string(), ErrorKind::internal, context);
  const Layout body = lay_out(model), shown = lay_out_vtk(model);
  std::vector<const Entry*> entries;
  for (const Layout* layout : {&body, &shown}) {
    for (const Entry& entry : layout->entries()) entries.push_back(&entry);
  }

  files::AtomicFile target(path);
  {
    OutputFile file(target.temporary(), path, bound(entries));
    file.make_group("/ecorche/tissues");  // also where a body has none
    file.make_group("/ecorche/volumes");
    std::vector<std::uint64_t> digests;
    run_as_in_turn(
        {[&] { digests = digests_of(entries, context); }, [&] { add_all(entries, file, context); }});
    const Layout table = contents(entries, digests);
    for (const Entry& entry : table.entries()) file.add(entry);
    file.set_attribute("/ecorche", "format", std::array<std::int32_t, 2>{format_major, minor_of(model)});
    file.set_attribute("/VTKHDF", "Version", std::array<std::int64_t, 2>{1, 0});
    file.set_attribute("/VTKHDF", "Type", "UnstructuredGrid");
    file.close();
  }
  context.check_stop();
  target.commit();
}

}  // namespace ecorche::model_file
