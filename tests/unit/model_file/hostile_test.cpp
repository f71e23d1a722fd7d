// SPDX-License-Identifier: Apache-2.0
// Files that somebody made on purpose: valid HDF5, with good digests where it helps, and none of them a
// model.
#include <sys/stat.h>

#include <array>

#include "core/model_file/guard.hpp"
#include "tests/unit/model_file/hostile.hpp"

namespace ecorche::test {
namespace {

TEST_F(Hostile, TheForgeItselfIsHarmless) {
  {
    Forge forge(file("a.hdf"));
    forge.edit<float>(kWeight, H5T_NATIVE_FLOAT, [](auto&) {});
  }
  expect_same(model_file::read(file("a.hdf"), {}), toy_model());
}

// A path that names a group of nobody is passed over: what it stood for would be gone without a word.
TEST_F(Hostile, APathOfTheContentsPageThatWasDamaged) {
  const std::string confidence = "/ecorche/skeleton/fit_confidence";
  Bytes bytes = load(file("a.hdf"));
  const auto at = std::search(bytes.begin(), bytes.end(), confidence.begin(), confidence.end());
  ASSERT_NE(at, bytes.end());
  at[16] = 'm';  // skeletom
  store(file("a.hdf"), bytes);
  expect_refused([](Forge&) {}, {"/ecorche/digests", "is damaged: its XXH64 is not the stored one"});
}

TEST_F(Hostile, ADigestOfTheContentsPageThatIsNone) {
  const auto early = [](hid_t creation) { H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY); };
  expect_refused([&](Forge& f) { f.dataset("/ecorche/digests/own", H5T_STD_U64LE, {2}, early); },
                 {"/ecorche/digests/own", "is not one u64"});
}

// As of versions that wrote none.
TEST_F(Hostile, AContentsPageWithoutADigest) {
  {
    Forge forge(file("a.hdf"));
    forge.remove("/ecorche/digests/own");
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
        {kWeight, "declares more than its file of ", " bytes can hold"});
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

TEST_F(Hostile, AContentsPageOfNumbers) {
  const auto early = [](hid_t creation) { H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY); };
  expect_refused([&](Forge& f) { f.dataset("/ecorche/digests/dataset", H5T_STD_U64LE, {4}, early); },
                 {"/ecorche/digests/dataset", "is not a list of text"});
}

TEST_F(Hostile, AFileThatBecomesShorter) {
  store(file("b.hdf"), Bytes(100, 'a'));
  const model_file::InputFile input(file("b.hdf"));
  std::filesystem::resize_file(file("b.hdf"), 50);
  std::array<std::byte, 100> bytes{};
  const Error error = error_of([&] { input.read(0, bytes); });
  EXPECT_EQ(error.kind(), ErrorKind::io);
  EXPECT_EQ(error.problem(), "became shorter meanwhile");
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
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [&](Forge& forge) { forge.dataset("/VTKHDF/Connectivity", H5T_STD_I32LE, {4 * 432 + 1}, early); },
      {"/VTKHDF/Connectivity", "does not fill its last row"});
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [&](Forge& forge) { forge.dataset("/ecorche/volumes/ct/voxels", H5T_STD_U64LE, {3}, early); },
      {"/ecorche/volumes/ct/voxels", "u64 is not a type of voxels"});
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

// What 1.1 did not write: read as it was, with no number for what was not measured then.
TEST_F(Hostile, AnOlderMinorVersionLacksWhatCameLater) {
  Model model = toy_model();
  std::fill(model.tet_label.begin(), model.tet_label.end(), TetMesh::soft);
  model.contested = {1, 2, 3};
  model.certificate.bone_tet_change = 0.5;
  model_file::write(model, file("a.hdf"), {});
  expect_same(model_file::read(file("a.hdf"), {}), model);
  {
    Forge forge(file("a.hdf"));
    Forge::Table rows = forge.table();
    std::erase_if(rows, [](const auto& row) {
      return row.first == "/ecorche/labels/contested" || row.first == "/ecorche/quality/bone_tet_change";
    });
    forge.set_table(rows);
  }
  EXPECT_EQ(error_of([&] { model_file::read(file("a.hdf"), {}); }).kind(), ErrorKind::data);
  {
    Forge forge(file("a.hdf"));
    set_format(forge.file(), {1, 1});
  }
  const Model older = model_file::read(file("a.hdf"), {});
  EXPECT_TRUE(older.contested.empty());
  EXPECT_TRUE(std::isnan(older.certificate.bone_tet_change));
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
