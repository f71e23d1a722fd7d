// SPDX-License-Identifier: Apache-2.0
// Files with all their signatures in order that are no model: parts missing, of the wrong kind, or saying
// nonsense.
#include <utility>

#include "tests/unit/model_file/hostile.hpp"

namespace ecorche::test {
namespace {

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
      {"/ecorche/weights", "cannot be opened as a group: "});
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) {
        forge.remove(kWeight);
        forge.group(kWeight);
      },
      {kWeight, "cannot be opened as a dataset: "});
}

// Large arrays come in blocks: each row to its place, and what is wrong is told by its row.
TEST_F(Hostile, ARowFarBehindTheFirstBlock) {
  Model model = toy_model();
  const Eigen::Index times = 700;
  model.tets = model.tets.replicate(times, 1).eval();
  const std::vector<std::uint16_t> label = std::exchange(model.tet_label, {});
  for (Eigen::Index i = 0; i < times; ++i)
    model.tet_label.insert(model.tet_label.end(), label.begin(), label.end());
  model.contested.clear();
  ASSERT_GT(model.tet_count(), 300'000U);
  model_file::write(model, file("a.hdf"), {});
  expect_same(model_file::read(file("a.hdf"), {}), model);
  expect_refused(
      [](Forge& forge) {
        forge.edit<std::int32_t>("/VTKHDF/Offsets", H5T_NATIVE_INT32,
                                 [](auto& v) { std::swap(v[200'000], v[200'001]); });
      },
      {"/VTKHDF/Offsets", "row 200000"});
  model_file::write(model, file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) {
        forge.edit<std::uint8_t>("/VTKHDF/Types", H5T_NATIVE_UINT8, [](auto& v) { v[300'000] = 12; });
      },
      {"/VTKHDF/Types", "not a tetrahedron"});
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
        forge.edit<std::int32_t>("/ecorche/skeleton/angle_joint", H5T_NATIVE_INT32,
                                 [](auto& v) { v[0] = 99; });
      },
      {"/ecorche/skeleton/angle_joint", "99 is not a segment"});
  model_file::write(toy_model(), file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) {
        const std::string path = "/ecorche/tissues/muscle/group";
        const Id type = model_file::hdf::file_type(model_file::ElementType::text, 8);
        const Id made = forge.dataset(path, type, {1});
        const std::string sinew("sinew\0\0\0", 8);
        EXPECT_GE(H5Dwrite(made, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, sinew.data()), 0);
        Forge::Table rows = forge.table();
        for (auto& [name, digest] : rows) {
          if (name == path) digest = XXH64(sinew.data(), sinew.size(), 0);
        }
        forge.set_table(rows);
      },
      {"/ecorche/tissues/muscle/group", "'sinew' is not a group"});
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

}  // namespace
}  // namespace ecorche::test
