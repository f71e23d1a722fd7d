// SPDX-License-Identifier: Apache-2.0
// The cases under examples/ that come from label maps. Their data is not ours to ship: ECORCHE_DATA names its
// folder.
#include <gtest/gtest.h>

#include <cstdlib>

#include <ecorche/io/case_file.hpp>
#include "io/case/yaml_reader.hpp"
#include "preprocess/label_surfaces/label_surfaces.hpp"
#include "tests/unit/phantom/mesh_checks.hpp"

namespace ecorche::io {
namespace {

const std::filesystem::path kExamples = ECORCHE_SOURCE "/examples";
const std::array<const char*, 3> kLabelled{"icrp110_female", "knee", "arm"};

TEST(Examples, AreYamlWithoutTheirData) {
  for (const char* name : kLabelled) {
    for (const auto& entry : std::filesystem::directory_iterator(kExamples / name)) {
      if (entry.path().extension() != ".yaml") continue;
      EXPECT_NO_THROW(yaml::Value::read(entry.path())) << entry.path();
    }
    try {  // everything before the first file of the data folder is right
      read_case(kExamples / name, {}, Context{});
      FAIL() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.problem(), "the data folder is not known") << error.what();
    }
  }
}

TEST(Examples, EverySurfaceIsClosed) {
  const char* const data = std::getenv("ECORCHE_DATA");
  if (data == nullptr) GTEST_SKIP() << "set ECORCHE_DATA to the folder of the examples' data";
  CaseOptions options;
  options.data = data;
  for (const char* name : kLabelled) {
    Case patient = read_case(kExamples / name, options, Context{});
    label_surfaces::resolve(patient, Context{});
    std::printf("%s: %zu bones, %zu tissues, skin of %ld triangles\n", name, patient.bones.size(),
                patient.tissues.size(), static_cast<long>(patient.skin.F.rows()));
    const auto expect_closed = [](const SurfaceMesh& mesh, const std::string& of) {
      std::vector<std::array<std::int32_t, 2>> edges;
      for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
        for (int c = 0; c < 3; ++c) edges.push_back({mesh.F(f, c), mesh.F(f, (c + 1) % 3)});
      }
      std::sort(edges.begin(), edges.end());
      EXPECT_EQ(std::adjacent_find(edges.begin(), edges.end()), edges.end()) << of;
      for (const auto& [a, b] : edges) {
        if (!std::binary_search(edges.begin(), edges.end(), std::array<std::int32_t, 2>{b, a})) {
          ADD_FAILURE() << of << " is open";
          break;
        }
      }
      EXPECT_GT(phantom::volume(mesh), 0) << of;
    };
    expect_closed(patient.skin, "skin");
    for (const CaseBone& bone : patient.bones) expect_closed(bone.surface, bone.name);
    for (const CaseTissue& tissue : patient.tissues) expect_closed(tissue.surface, tissue.name);
  }
}

}  // namespace
}  // namespace ecorche::io
