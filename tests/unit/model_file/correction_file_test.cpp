// SPDX-License-Identifier: Apache-2.0
// Corrections and safe ranges that somebody spoilt on purpose.
#include <tuple>

#include "tests/unit/model_file/hostile.hpp"

namespace ecorche::test {
namespace {

TEST_F(Hostile, CorrectionOfNoJoint) {
  model_file::write(corrected_toy_model(), file("a.hdf"), {});
  expect_refused(
      [](Forge& forge) {
        H5Lmove(forge.file(), "/ecorche/packed_correction/tip_joint", forge.file(),
                "/ecorche/packed_correction/nobody", H5P_DEFAULT, H5P_DEFAULT);
        Forge::Table rows = forge.table();
        const std::string from = "/packed_correction/tip_joint/";
        for (auto& [path, digest] : rows) {
          if (const std::size_t at = path.find(from); at != std::string::npos)
            path.replace(at, from.size(), "/packed_correction/nobody/");
        }
        forge.set_table(rows);
      },
      {"/ecorche/packed_correction/nobody/index", "a joint that the skeleton has not"});
}

TEST_F(Hostile, CorrectionThatDoesNotFitItself) {
  const std::string at = "/ecorche/packed_correction/tip_joint/";
  for (const auto& [name, type, shape] :
       {std::tuple{"mix", H5T_IEEE_F32LE, std::vector<hsize_t>{4, 2}},
        std::tuple{"shift", H5T_STD_U8LE, std::vector<hsize_t>{2, 7}},
        std::tuple{"shift", H5T_STD_U8LE, std::vector<hsize_t>{2, hsize_t{1} << 40}},
        std::tuple{"word", H5T_STD_I16LE, std::vector<hsize_t>{21, 3}},
        std::tuple{"turn", H5T_IEEE_F64LE, std::vector<hsize_t>{5, 4}},
        std::tuple{"scale", H5T_IEEE_F64LE, std::vector<hsize_t>{2}}}) {
    model_file::write(corrected_toy_model(), file("a.hdf"), {});
    expect_refused(
        [&, name = name, type = type, shape = shape](Forge& forge) {
          const auto late = [](hid_t creation) { H5Pset_alloc_time(creation, H5D_ALLOC_TIME_LATE); };
          forge.dataset(at + name, type, shape, late);
        },
        {at + name});
  }
}

TEST_F(Hostile, CorrectionOfNodesThatAreNot) {
  model_file::write(corrected_toy_model(), file("a.hdf"), {});
  const std::string at = "/ecorche/packed_correction/tip_joint/node";
  expect_refused(
      [&](Forge& forge) {
        forge.edit<std::uint32_t>(at, H5T_NATIVE_UINT32, [](auto& nodes) { nodes.back() = 0xffffffffU; });
      },
      {at, "not ascending rows of nodes"});
}

TEST_F(Hostile, PackedFieldThatDoesNotFitItsNumbers) {
  for (const std::string& at : {std::string("/ecorche/packed_correction/tip_joint/"),
                                std::string("/ecorche/packed_pose_correction/place_1/")}) {
    for (const std::uint8_t shift : {0, 9, 255}) {
      model_file::write(corrected_toy_model(), file("a.hdf"), {});
      expect_refused(
          [&](Forge& forge) {
            forge.edit<std::uint8_t>(at + "shift", H5T_NATIVE_UINT8,
                                     [&](auto& shifts) { shifts.back() = shift; });
          },
          {at + "shift", "does not fit the numbers in byte and word"});
    }
  }
}

TEST_F(Hostile, SafeRangesOfOtherLengths) {
  model_file::write(corrected_toy_model(), file("a.hdf"), {});
  const std::string at = "/ecorche/safe_range/bones";
  expect_refused([&](Forge& forge) { forge.dataset(at, H5T_IEEE_F64LE, {3}); }, {at});
}

}  // namespace
}  // namespace ecorche::test
