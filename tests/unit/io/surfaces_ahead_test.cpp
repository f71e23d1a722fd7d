// SPDX-License-Identifier: Apache-2.0
// Surfaces read side by side, against the same read one by one.
#include "io/case/surfaces_ahead.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

namespace fs = std::filesystem;

// What holds on to limits and context lives no longer than they.
struct SurfacesAheadTest : testing::Test {
  const Scratch folder;
  const files::ReadLimits limits{};
  const Context context{};
  SurfacesAhead surfaces{limits, context};
};

void write_tetrahedron(const fs::path& path, double size) {
  SurfaceMesh mesh;
  mesh.V.resize(4, 3);
  mesh.V << 0, 0, 0, size, 0, 0, 0, size, 0, 0, 0, size;
  mesh.F.resize(4, 3);
  mesh.F << 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3;
  write_surface(path, mesh);
}

TEST_F(SurfacesAheadTest, AreThoseThatAreReadOneByOne) {
  const fs::path bones = folder / "bones", data = folder / "elsewhere";
  fs::create_directories(bones);
  fs::create_directories(data);
  write_tetrahedron(folder / "skin.stl", 100);
  write_tetrahedron(bones / "a.ply", 1);
  write_tetrahedron(data / "b.obj", 2);
  const yaml::Value root = yaml::Value::parse(
      "skin: skin.stl\n"
      "bones:\n"
      "  - {name: a, file: bones/a.ply}\n"
      "  - {name: b, file: b.obj, root: data}\n"
      "  - {name: again, file: bones/a.ply}\n"
      "  - {name: of_labels, labels: [1]}\n"
      "tissues:\n"
      "  - {name: not_there, file: nothing.stl}\n",
      "case.yaml");
  surfaces.read(root, folder.path(), data);
  // Twice: what two entries name is read again for the second.
  for (const fs::path& path : {folder / "skin.stl", bones / "a.ply", bones / "a.ply", data / "b.obj"}) {
    const TaggedSurface ahead = surfaces.take(path), asked = read_tagged_surface(path);
    EXPECT_EQ(ahead.mesh.V, asked.mesh.V) << path;
    EXPECT_EQ(ahead.mesh.F, asked.mesh.F) << path;
    EXPECT_EQ(ahead.space, asked.space) << path;
  }
}

TEST_F(SurfacesAheadTest, WhatIsWrongIsToldWhereItIsTaken) {
  const fs::path broken = folder.put("broken.stl", "solid no triangle");
  const yaml::Value root = yaml::Value::parse(
      "skin: [no, skin]\n"
      "bones:\n"
      "  - {name: a, file: broken.stl}\n"
      "  - {name: b, file: {no: name}}\n"
      "  - {name: c, file: c.stl, root: data}\n"
      "tissues: none\n",
      "case.yaml");
  EXPECT_NO_THROW(surfaces.read(root, folder.path(), {}));
  const auto asked = error_of([&] { read_tagged_surface(broken); });
  const auto told = error_of([&] { surfaces.take(broken); });
  ASSERT_TRUE(asked && told);
  EXPECT_STREQ(told->what(), asked->what());
}

TEST_F(SurfacesAheadTest, NobodyWaitsForAPipe) {
  ASSERT_EQ(mkfifo((folder / "pipe.stl").c_str(), 0600), 0);
  surfaces.read(yaml::Value::parse("skin: pipe.stl\n", "case.yaml"), folder.path(), {});
}

}  // namespace
}  // namespace ecorche::io
