// SPDX-License-Identifier: Apache-2.0
// Files that somebody made on purpose: valid HDF5, with good digests where it helps, and none of them a
// model.
#include <sys/stat.h>
#include <xxhash.h>

#include <functional>

#include "core/model_file/hdf.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/model_file/test_files.hpp"

namespace ecorche::test {
namespace {

using model_file::hdf::Id;

// An existing model, opened to be spoilt.
class Forge {
 public:
  explicit Forge(const std::filesystem::path& path) {
    const Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V110);
    file_ = Id(H5Fopen(path.c_str(), H5F_ACC_RDWR, access), H5Fclose);
    EXPECT_TRUE(file_.good());
  }
  hid_t file() const { return file_; }

  void remove(const std::string& path) { EXPECT_GE(H5Ldelete(file_, path.c_str(), H5P_DEFAULT), 0) << path; }
  void group(const std::string& path) {
    const Id group(H5Gcreate2(file_, path.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    EXPECT_TRUE(group.good()) << path;
  }
  // Replaces or makes a dataset; `set_up` may ask for chunks, filters, external files.
  Id dataset(const std::string& path, hid_t type, const std::vector<hsize_t>& shape,
             const std::function<void(hid_t)>& set_up = {}) {
    if (H5Lexists(file_, path.c_str(), H5P_DEFAULT) > 0) remove(path);
    const Id space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
    const Id creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    if (set_up) set_up(creation);
    Id made(H5Dcreate2(file_, path.c_str(), type, space, H5P_DEFAULT, creation, H5P_DEFAULT), H5Dclose);
    EXPECT_TRUE(made.good()) << path;
    return made;
  }
  // Changes the contents of a dataset in place and signs them again.
  template <class T>
  void edit(const std::string& path, hid_t type, const std::function<void(std::vector<T>&)>& change) {
    const Id dataset(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
    std::vector<T> values(H5Dget_storage_size(dataset) / sizeof(T));
    EXPECT_GE(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
    change(values);
    EXPECT_GE(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
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
  }
  // Names a dataset in the contents page.
  void enlist(const std::string& path) {
    Table rows = table();
    rows.emplace_back(path, 0);
    set_table(rows);
  }

 private:
  Id file_;
};

class Hostile : public ModelFileTest {
 protected:
  Hostile() { model_file::write(toy_model(), file("a.hdf"), {}); }
  const std::string& read_error(const std::function<void(Forge&)>& spoil) {
    {
      Forge forge(file("a.hdf"));
      spoil(forge);
    }
    const Error error = error_of([&] { model_file::read(file("a.hdf"), {}); });
    EXPECT_EQ(error.kind(), ErrorKind::data) << error.what();
    return text_ = error.what();
  }
  // The message says all of these.
  void expect_refused(const std::function<void(Forge&)>& spoil, const std::vector<std::string>& words) {
    const std::string error = read_error(spoil);
    for (const std::string& word : words) EXPECT_NE(error.find(word), std::string::npos) << error;
  }

 private:
  std::string text_;
};

const std::string kWeight = "/ecorche/weights/weight";

TEST_F(Hostile, TheForgeItselfIsHarmless) {
  {
    Forge forge(file("a.hdf"));
    forge.edit<float>(kWeight, H5T_NATIVE_FLOAT, [](auto&) {});
  }
  expect_same(model_file::read(file("a.hdf"), {}), toy_model());
}

TEST_F(Hostile, ExternalStorage) {
  store(file("secret"), Bytes(4096, 's'));
  expect_refused(
      [&](Forge& forge) {
        forge.dataset(kWeight, H5T_STD_U8LE, {4096},
                      [&](hid_t creation) { H5Pset_external(creation, file("secret").c_str(), 0, 4096); });
      },
      {kWeight, "another file"});
}

TEST_F(Hostile, ExternalLink) {
  model_file::write(toy_model(), file("b.hdf"), {});
  expect_refused(
      [&](Forge& forge) {
        forge.remove("/ecorche/weights");
        H5Lcreate_external(file("b.hdf").c_str(), "/ecorche/weights", forge.file(), "/ecorche/weights",
                           H5P_DEFAULT, H5P_DEFAULT);
      },
      {"/ecorche/weights", "soft or external link"});
}

TEST_F(Hostile, SoftLink) {
  expect_refused(
      [](Forge& forge) {
        forge.remove("/ecorche/weights/segment");
        H5Lcreate_soft("/VTKHDF/PointData/dominant_segment", forge.file(), "/ecorche/weights/segment",
                       H5P_DEFAULT, H5P_DEFAULT);
      },
      {"/ecorche/weights/segment", "soft or external link"});
}

TEST_F(Hostile, SoftLinkInPlaceOfTheWhole) {
  expect_refused(
      [](Forge& forge) {
        H5Lmove(forge.file(), "/ecorche", forge.file(), "/other", H5P_DEFAULT, H5P_DEFAULT);
        H5Lcreate_soft("/other", forge.file(), "/ecorche", H5P_DEFAULT, H5P_DEFAULT);
      },
      {"/ecorche", "soft or external link"});
}

TEST_F(Hostile, VirtualDataset) {
  model_file::write(toy_model(), file("b.hdf"), {});
  expect_refused(
      [&](Forge& forge) {
        const hsize_t extent = 16;
        const Id space(H5Screate_simple(1, &extent, nullptr), H5Sclose);
        forge.dataset(kWeight, H5T_IEEE_F32LE, {extent}, [&](hid_t creation) {
          H5Pset_virtual(creation, space, file("b.hdf").c_str(), kWeight.c_str(), space);
        });
      },
      {kWeight, "one piece"});
}

TEST_F(Hostile, ChunkedAndFiltered) {
  expect_refused(
      [](Forge& forge) {
        forge.dataset(kWeight, H5T_IEEE_F32LE, {1024}, [](hid_t creation) {
          const hsize_t chunk = 256;
          H5Pset_chunk(creation, 1, &chunk);
          H5Pset_deflate(creation, 9);
        });
      },
      {kWeight, "one piece"});
}

TEST_F(Hostile, Compact) {
  expect_refused(
      [](Forge& forge) {
        forge.dataset(kWeight, H5T_IEEE_F32LE, {16},
                      [](hid_t creation) { H5Pset_layout(creation, H5D_COMPACT); });
      },
      {kWeight, "one piece"});
}

TEST_F(Hostile, DeclaredTerabytes) {
  for (const std::vector<hsize_t>& shape :
       {std::vector<hsize_t>{hsize_t{1} << 40}, {hsize_t{1} << 20, hsize_t{1} << 22}}) {
    expect_refused(
        [&](Forge& forge) {
          forge.dataset(kWeight, H5T_IEEE_F32LE, shape,
                        [](hid_t creation) { H5Pset_alloc_time(creation, H5D_ALLOC_TIME_LATE); });
        },
        {kWeight, "can hold"});
  }
}

TEST_F(Hostile, NotWholeOnTheDisk) {
  expect_refused(
      [](Forge& forge) {
        forge.dataset(kWeight, H5T_IEEE_F32LE, {64},
                      [](hid_t creation) { H5Pset_alloc_time(creation, H5D_ALLOC_TIME_LATE); });
      },
      {kWeight, "not wholly stored"});
}

// A few bytes named a thousand times would fill the memory.
TEST_F(Hostile, OneDatasetUnderManyNames) {
  expect_refused(
      [](Forge& forge) {
        Forge::Table rows = forge.table();
        for (int i = 0; i < 1000; ++i) {
          rows.emplace_back("/ecorche/cor/p" + std::to_string(i), 0);
          H5Lcreate_hard(forge.file(), "/VTKHDF/Points", forge.file(),
                         ("/ecorche/cor/p" + std::to_string(i)).c_str(), H5P_DEFAULT, H5P_DEFAULT);
        }
        forge.set_table(rows);
      },
      {"/ecorche/cor/p", "can hold"});
}

TEST_F(Hostile, GroupsInACircle) {
  expect_refused(
      [](Forge& forge) {
        H5Lcreate_hard(forge.file(), "/ecorche/tissues", forge.file(), "/ecorche/tissues/skin2", H5P_DEFAULT,
                       H5P_DEFAULT);
        forge.enlist("/ecorche/tissues/skin2/index");
      },
      {"/ecorche/tissues/skin2/index", "missing"});
}

TEST_F(Hostile, TooManyMembers) {
  expect_refused(
      [](Forge& forge) {
        forge.remove("/ecorche/tissues");
        forge.group("/ecorche/tissues");
        for (int i = 0; i < 5000; ++i) {
          H5Lcreate_hard(forge.file(), "/ecorche/cor", forge.file(),
                         ("/ecorche/tissues/t" + std::to_string(i)).c_str(), H5P_DEFAULT, H5P_DEFAULT);
        }
      },
      {"/ecorche/tissues", "5000 members"});
}

// HDF5 1.10 frees what it never allocated when such a group is damaged and listed.
TEST_F(Hostile, LinksOutsideOfTheirGroup) {
  expect_refused(
      [](Forge& forge) {
        forge.remove("/ecorche/volumes");
        forge.group("/ecorche/volumes");
        for (int i = 0; i < 50; ++i) forge.group("/ecorche/volumes/v" + std::to_string(i));
      },
      {"/ecorche/volumes", "outside of its header"});
}

TEST_F(Hostile, AContentsPageThatLies) {
  for (const char* path : {"/ecorche/weights/none", "/ecorche/weights/", "/ecorche/weights/.", "/ecorche/cor",
                           "/ecorche/digests/xxh64", "/ecorche/tissues/none/points"}) {
    model_file::write(toy_model(), file("a.hdf"), {});
    expect_refused([&](Forge& forge) { forge.enlist(path); }, {"/ecorche/"});
  }
  for (const char* path :
       {"", "/", "//", "none", "/mine/none", "/ecorche/tissues/Skin 2/points",
        "/ecorche/tissues/../../points", "/ecorche/weights/../cor/sigma"}) {  // not our groups
    model_file::write(toy_model(), file("a.hdf"), {});
    Forge(file("a.hdf")).enlist(path);
    expect_same(model_file::read(file("a.hdf"), {}), toy_model());
  }
}

TEST_F(Hostile, ContentsWithoutADigestEach) {
  const auto early = [](hid_t creation) { H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY); };
  expect_refused([&](Forge& f) { f.dataset("/ecorche/digests/xxh64", H5T_STD_U64LE, {1}, early); },
                 {"/ecorche/digests/xxh64", "is not one u64 per dataset"});
}

TEST_F(Hostile, ADatasetThatIsNotListed) {
  expect_refused(
      [](Forge& forge) {
        Forge::Table rows = forge.table();
        std::erase_if(rows, [](const auto& row) { return row.first == kWeight; });
        forge.set_table(rows);
      },
      {kWeight, "missing"});
}

TEST_F(Hostile, WrongTypes) {
  const Id variable(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(variable, H5T_VARIABLE);
  const Id pair(H5Tcreate(H5T_COMPOUND, 8), H5Tclose);
  H5Tinsert(pair, "x", 0, H5T_IEEE_F32LE);
  for (const hid_t type : {H5T_IEEE_F32BE, hid_t{variable}, hid_t{pair}, H5T_STD_REF_OBJ, H5T_STD_B32LE}) {
    expect_refused([&](Forge& forge) { forge.dataset(kWeight, type, {8}); }, {kWeight, "type other than"});
  }
  expect_refused(
      [](Forge& forge) {
        forge.dataset(kWeight, H5T_IEEE_F64LE, {8},
                      [](hid_t creation) { H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY); });
      },
      {kWeight, "is f64, not f32"});
}

TEST_F(Hostile, WrongShapes) {
  const auto early = [](hid_t creation) { H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY); };
  expect_refused(
      [&](Forge& forge) {
        forge.dataset(kWeight, H5T_IEEE_F32LE, {8, 1}, early);
      },
      {kWeight, "has the shape 8 x 1, not"});
  expect_refused(
      [&](Forge& forge) {
        forge.dataset("/VTKHDF/Points", H5T_IEEE_F32LE, {8, 2}, early);
      },
      {"/VTKHDF/Points", "has the shape 8 x 2, not n x 3"});
}

TEST_F(Hostile, AScalarWithoutShape) {
  expect_refused(
      [](Forge& forge) {
        forge.remove("/ecorche/cor/sigma");
        const Id space(H5Screate(H5S_NULL), H5Sclose);
        const Id made(H5Dcreate2(forge.file(), "/ecorche/cor/sigma", H5T_IEEE_F64LE, space, H5P_DEFAULT,
                                 H5P_DEFAULT, H5P_DEFAULT),
                      H5Dclose);
      },
      {"/ecorche/cor/sigma", "simple shape"});
}

TEST_F(Hostile, MissingParts) {
  for (const char* path :
       {"/ecorche/weights/weight", "/ecorche/quality/min_weight", "/ecorche/tissues/skin/index",
        "/ecorche/digests/xxh64", "/VTKHDF/Types", "/ecorche/skeleton", "/ecorche/volumes"}) {
    model_file::write(toy_model(), file("a.hdf"), {});
    expect_refused([&](Forge& forge) { forge.remove(path); }, {path, "is missing"});
  }
}

TEST_F(Hostile, ADatasetWhereAGroupBelongs) {
  expect_refused(
      [](Forge& forge) {
        forge.remove("/ecorche/weights");
        forge.dataset("/ecorche/weights", H5T_STD_U8LE, {1});
      },
      {"/ecorche/weights", "as a group"});
}

TEST_F(Hostile, SignedContentsThatAreNoModel) {
  expect_refused(
      [](Forge& forge) {
        forge.edit<std::uint64_t>("/ecorche/weights/offsets", H5T_NATIVE_UINT64,
                                  [](auto& v) { std::swap(v[3], v[5]); });
      },
      {"/ecorche/weights/offsets", "grow"});
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) {
        forge.edit<std::int32_t>("/VTKHDF/Connectivity", H5T_NATIVE_INT32, [](auto& v) { v[9] = 1 << 30; });
      },
      {"/VTKHDF/Connectivity", "does not exist"});
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) {
        forge.edit<std::int32_t>("/VTKHDF/Offsets", H5T_NATIVE_INT32, [](auto& v) { std::swap(v[9], v[8]); });
      },
      {"/VTKHDF/Offsets", "row 8"});
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) { forge.edit<float>(kWeight, H5T_NATIVE_FLOAT, [](auto& v) { v[0] = -v[0]; }); },
      {kWeight, "[0, 1]"});
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) {
        forge.edit<std::int32_t>("/ecorche/skeleton/parent", H5T_NATIVE_INT32, [](auto& v) { v[1] = 2; });
      },
      {"/ecorche/skeleton/parent", "earlier row"});
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) {
        forge.edit<std::int32_t>("/ecorche/skeleton/angle_joint", H5T_NATIVE_INT32,
                                 [](auto& v) { v[1] = -1; });
      },
      {"/ecorche/skeleton/angle_joint", "-1"});
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) {
        forge.edit<std::int32_t>("/ecorche/skeleton/angle_joint", H5T_NATIVE_INT32, [](auto& v) {
          v.front() = 2;
          v.back() = 1;
        });
      },
      {"/ecorche/skeleton/angle_joint", "is not sorted"});
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) {
        forge.edit<std::uint8_t>("/ecorche/volumes/ct/labels", H5T_NATIVE_UINT8, [](auto& v) { v[0] = 7; });
      },
      {"/ecorche/volumes/ct/labels", "is neither 0 nor 1"});
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) {
        forge.edit<std::uint8_t>("/ecorche/skeleton/kind", H5T_NATIVE_UINT8, [](auto& v) { v[1] = 99; });
      },
      {"/ecorche/skeleton/kind", "99 has no meaning"});
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) {
        forge.edit<std::int32_t>("/ecorche/tissues/muscle/index", H5T_NATIVE_INT32,
                                 [](auto& v) { v[0] = 0; });
      },
      {"/index", "0 is not a place of its own"});
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) {
        forge.edit<std::int32_t>("/ecorche/volumes/ct/size", H5T_NATIVE_INT32, [](auto& v) { v[0] = -6; });
      },
      {"/ecorche/volumes/ct/voxels", "shape"});
}

void set_format(hid_t file, std::vector<std::int32_t> format) {
  H5Adelete_by_name(file, "/ecorche", "format", H5P_DEFAULT);
  const hsize_t extent = format.size();
  const Id space(H5Screate_simple(1, &extent, nullptr), H5Sclose);
  const Id attribute(H5Acreate_by_name(file, "/ecorche", "format", H5T_STD_I32LE, space, H5P_DEFAULT,
                                       H5P_DEFAULT, H5P_DEFAULT),
                     H5Aclose);
  EXPECT_GE(H5Awrite(attribute, H5T_STD_I32LE, format.data()), 0);
}

TEST_F(Hostile, AnotherMajorVersion) {
  expect_refused(
      [](Forge& forge) {
        set_format(forge.file(), {2, 0});
      },
      {"format", "2.0", "preprocess again"});
  expect_refused([](Forge& forge) { set_format(forge.file(), {1, 0, 0}); }, {"format", "two 32-bit"});
  expect_refused([](Forge& forge) { H5Adelete_by_name(forge.file(), "/ecorche", "format", H5P_DEFAULT); },
                 {"format", "not a model"});
}

// What a newer minor version may add, and what anybody may put beside a model.
TEST_F(Hostile, UnknownGroupsAreLeftAlone) {
  {
    Forge forge(file("a.hdf"));
    set_format(forge.file(), {1, 7});
    for (const char* path : {"/mine", "/mine/deep", "/ecorche/later", "/ecorche/later/ct",
                             "/VTKHDF/FieldData", "/ecorche/weights/later"}) {
      forge.group(path);
    }
    H5Lcreate_soft("/nowhere", forge.file(), "/mine/soft", H5P_DEFAULT, H5P_DEFAULT);
    H5Lcreate_external("/etc/passwd", "/", forge.file(), "/ecorche/later/ct/external", H5P_DEFAULT,
                       H5P_DEFAULT);
    forge.dataset("/mine/huge", H5T_IEEE_F64LE, {hsize_t{1} << 50},
                  [](hid_t creation) { H5Pset_alloc_time(creation, H5D_ALLOC_TIME_LATE); });
    forge.dataset("/notes", H5T_STD_U8LE, {3}, [](hid_t creation) { H5Pset_layout(creation, H5D_COMPACT); });
  }
  expect_same(model_file::read(file("a.hdf"), {}), toy_model());
  for (const auto& check : model_file::check_digests(file("a.hdf"), {}))
    EXPECT_TRUE(check.good) << check.dataset;
}

TEST_F(Hostile, AnotherHdf5FileIsNoModel) {
  {
    const Id made(H5Fcreate(file("b.hdf").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
    EXPECT_TRUE(made.good());
  }
  const Error error = error_of([&] { model_file::read(file("b.hdf"), {}); });
  EXPECT_EQ(error.kind(), ErrorKind::data);
  EXPECT_NE(error.problem().find("not a model of ecorche"), std::string::npos) << error.what();
}

TEST_F(Hostile, APipeDoesNotBlock) {
  ASSERT_EQ(::mkfifo(file("pipe.hdf").c_str(), 0600), 0);
  EXPECT_EQ(error_of([&] { model_file::read(file("pipe.hdf"), {}); }).kind(), ErrorKind::missing_input);
}

}  // namespace
}  // namespace ecorche::test
