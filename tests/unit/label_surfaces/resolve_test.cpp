// SPDX-License-Identifier: Apache-2.0
// A case whose entries come from labels.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "preprocess/label_surfaces/label_surfaces.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/label_surfaces/bodies.hpp"

namespace ecorche::label_surfaces {
namespace {

Case labelled_case() {
  Case patient;
  patient.labels = draw(cube_grid(40), [](int i, int j, int k) {
    const double r = (Eigen::Vector3d(i, j, k) - Eigen::Vector3d(20, 20, 20)).norm();
    return r > 18 ? 0 : r > 14 ? 5 : k < 18 ? 200 : k < 22 ? 5 : 201;
  });
  patient.skin_source = ids({});
  patient.bones.resize(2);
  patient.bones[0].source = ids({200});
  patient.bones[1].source = ids({201});
  patient.tissues.resize(2);
  patient.tissues[0].source = ids({5});
  patient.tissues[1].surface.V.setOnes(3, 3);  // a tissue from a file stays what it is
  return patient;
}

TEST(Resolve, GivesEverySourceItsSurface) {
  Case patient = labelled_case();
  double last = 0;
  Context context;
  context.progress = [&](double fraction) { last = fraction; };
  resolve(patient, context);
  EXPECT_EQ(last, 1);
  phantom::expect_solid(patient.skin, "skin");
  phantom::expect_solid(patient.bones[0].surface, "bone 0");
  phantom::expect_solid(patient.bones[1].surface, "bone 1");
  phantom::expect_solid(patient.tissues[0].surface, "tissue");
  EXPECT_EQ(patient.tissues[1].surface.V.rows(), 3);
  EXPECT_FALSE(patient.skin_source || patient.bones[0].source || patient.tissues[0].source);
  EXPECT_NEAR(phantom::volume(patient.skin),
              phantom::volume(patient.bones[0].surface) + phantom::volume(patient.bones[1].surface) +
                  phantom::volume(patient.tissues[0].surface),
              0.01 * phantom::volume(patient.skin));
}

TEST(Resolve, NeedsALabelMapAndNoPicture) {
  Case patient = labelled_case();
  patient.labels.reset();
  patient.skin_source->where = "case.yaml:3:skin";
  expect_error(ErrorKind::config, "case.yaml:3:skin: the case has no labels (name them under labels)",
               [&] { resolve(patient, {}); });
  CaseLabels picture;
  picture.image = Image(cube_grid(41), ScalarType::u32);
  std::uint32_t next = 1;
  for (std::uint32_t& v : picture.image.scalars<std::uint32_t>()) v = next++;
  expect_error(ErrorKind::data,
               "labels: the label map has more than 65536 ids (is it a label map, or a picture?)",
               [&] { extract(picture, ids({1}), {}); });
}

TEST(Resolve, SpecksOffTheBodyBelongToNobody) {
  Case patient = labelled_case();
  auto voxels = patient.labels->image.scalars<std::uint8_t>();
  voxels[patient.labels->image.grid.offset(0, 0, 0)] = 5;
  EXPECT_EQ(phantom::components(extract(*patient.labels, ids({5}), {})), 4);
  resolve(patient, {});
  EXPECT_EQ(phantom::components(patient.tissues[0].surface), 3);  // a shell with a floor
  EXPECT_EQ(phantom::components(patient.skin), 1);
  Case listed = labelled_case();  // a skin of listed labels says nothing of the others
  listed.skin_source->ids = {5, 200, 201};
  listed.labels = patient.labels;
  resolve(listed, {});
  EXPECT_EQ(phantom::components(listed.tissues[0].surface), 4);
}

TEST(Resolve, SameBytesOnAnyNumberOfThreads) {
  Case one = labelled_case(), many = labelled_case();
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    resolve(one, {});
  }
  resolve(many, {});
  EXPECT_EQ(one.skin.V, many.skin.V);
  EXPECT_EQ(one.tissues[0].surface.V, many.tissues[0].surface.V);
  EXPECT_EQ(one.tissues[0].surface.F, many.tissues[0].surface.F);
}

TEST(Resolve, ALabelMapOfAnyIntegers) {
  Case patient = labelled_case();
  const Image bytes = patient.labels->image;
  Image wide(bytes.grid, ScalarType::i32);
  for (std::size_t v = 0; v < bytes.grid.voxels(); ++v) {
    const int id = bytes.scalars<std::uint8_t>()[v];
    wide.scalars<std::int32_t>()[v] = id == 200 ? -70000 : id == 201 ? 2'000'000'000 : id;
  }
  Case other = labelled_case();
  other.labels->image = wide;
  other.bones[0].source->ids = {-70000};
  other.bones[1].source->ids = {2'000'000'000};
  resolve(patient, {});
  resolve(other, {});
  EXPECT_EQ(patient.skin.V, other.skin.V);
  EXPECT_EQ(patient.bones[0].surface.V, other.bones[0].surface.V);
  EXPECT_EQ(patient.bones[1].surface.V, other.bones[1].surface.V);
}

TEST(Resolve, RefusesASourceWithoutVoxels) {
  Case patient = labelled_case();
  patient.bones[1].source->side = Side::right;
  patient.bones[1].source->plane_mm = -100;
  patient.bones[1].source->where = "case.yaml:8:bones[1]";
  try {
    resolve(patient, {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::config);
    EXPECT_STREQ(error.what(),
                 "case.yaml:8:bones[1]: its labels have no voxel there (check its ids, side and within)");
  }
}

// As where a label falls to `rest` of which one voxel was left in a corner by a slip.
TEST(Resolve, AStrayVoxelIsNamedAndLeftOutMoreAreRefused) {
  const auto with_strays = [](int count) {
    Case patient = labelled_case();
    auto voxels = patient.labels->image.scalars<std::uint8_t>();
    for (int n = 0; n < count; ++n)
      voxels[patient.labels->image.grid.offset(2 * (n % 15), 2 * (n / 15), 0)] = 77;
    patient.tissues.push_back({"gall_bladder", Group::organ, {}, ids({77})});
    patient.tissues.back().source->where = "case.yaml:9:tissues[2]";
    return patient;
  };
  Case one = with_strays(1);
  std::vector<std::string> warnings;
  Context context;
  context.log = [&](LogLevel, std::string_view line) { warnings.emplace_back(line); };
  resolve(one, context);
  EXPECT_EQ(one.tissues.size(), 2U);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_TRUE(warnings[0].starts_with("case.yaml:9:tissues[2]: 'gall_bladder': its only voxel, at ["))
      << warnings[0];
  EXPECT_TRUE(
      warnings[0].ends_with("], lies off the body; it is left out (take the label out of the image, or say "
                            "except: in the entry)"))
      << warnings[0];
  Case many = with_strays(65);
  const Case before = many;
  try {
    resolve(many, context);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::config);
    EXPECT_NE(std::string(error.what())
                  .find("'gall_bladder': all of its 65 voxels lie off the body, the first at ["),
              std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("join it to the body by the skin's close_mm"),
              std::string::npos);
  }
  Case bone = before;  // a bone is never left out
  bone.tissues.pop_back();
  bone.bones.push_back({"patella", "", {}, ids({77})});
  EXPECT_THROW(resolve(bone, context), Error);
}

TEST(Resolve, RefusesAPictureForALabelMap) {
  Case patient = labelled_case();
  Image noise(cube_grid(41), ScalarType::i32);
  for (std::size_t v = 0; v < noise.grid.voxels(); ++v)
    noise.scalars<std::int32_t>()[v] = static_cast<std::int32_t>(7 * v);
  patient.labels->image = noise;
  EXPECT_THROW(resolve(patient, {}), Error);
}

TEST(Resolve, StopsWhenAsked) {
  Case patient = labelled_case();
  std::stop_source stop;
  stop.request_stop();
  Context context;
  context.stop = stop.get_token();
  EXPECT_THROW(resolve(patient, context), Error);
}

}  // namespace
}  // namespace ecorche::label_surfaces
