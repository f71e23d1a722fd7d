// SPDX-License-Identifier: Apache-2.0
// A folder appears whole or not at all.
#include "core/files/staged_folder.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "core/files/atomic_file.hpp"
#include "tests/unit/model_file/test_files.hpp"

namespace ecorche::test {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<fs::path>;

class Staged : public ModelFileTest {
 protected:
  // What lies in the test's folder, hidden or not.
  Names all() { return files::files_within(file("").parent_path()); }

  static void fill(const files::StagedFolder& staged, const std::string& text) {
    fs::create_directories(staged.stage() / "bones");
    files::write_text(staged.stage() / "a.txt", text);
    files::write_text(staged.stage() / "bones/b.txt", text);
    files::write_text(staged.stage() / "seal.json", text);
  }
};

TEST_F(Staged, ANewFolderIsThereOnceItIsWhole) {
  {
    files::StagedFolder staged(file("out/"), "seal.json");  // a slash behind it is none of its name
    fill(staged, "1");
    EXPECT_FALSE(fs::exists(file("out")));
    staged.commit();
  }
  EXPECT_EQ(all(), (Names{"out/a.txt", "out/bones/b.txt", "out/seal.json"}));
}

TEST_F(Staged, WithoutACommitNothingIsLeft) {
  { fill(files::StagedFolder(file("out"), "seal.json"), "1"); }
  EXPECT_TRUE(all().empty());
  fs::create_directories(file("out"));
  files::write_text(file("out") / "mine.txt", "");
  { fill(files::StagedFolder(file("out"), "seal.json"), "1"); }
  EXPECT_EQ(all(), (Names{"out/mine.txt"}));
}

TEST_F(Staged, WhatIsThereGivesWayAndOtherFilesStay) {
  for (const char* text : {"1", "2"}) {
    files::StagedFolder staged(file("out"), "seal.json");
    fill(staged, text);
    if (*text == '2') fs::remove_all(staged.stage() / "bones");
    staged.commit(*text == '1' ? Names{} : Names{"a.txt", "bones/b.txt"});
    files::write_text(file("out") / "mine.txt", "");
  }
  EXPECT_EQ(all(), (Names{"out/a.txt", "out/mine.txt", "out/seal.json"}));
  EXPECT_FALSE(fs::exists(file("out/bones")));
  EXPECT_EQ(files::read_text(file("out/a.txt")), "2");
}

TEST_F(Staged, SweepsWhatKilledRunsLeft) {
  const pid_t dead = [] {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(0);
    ::waitpid(child, nullptr, 0);
    return child;
  }();
  const std::string stale = "." + std::to_string(dead) + ".part.",
                    other = "." + std::to_string(::getppid()) + ".part.out";
  for (const std::string& name : {stale + "out", stale + "else", other}) {
    fs::create_directories(file(name));
    files::write_text(file(name) / "half.txt", "");
  }
  files::StagedFolder(file("out"), "seal.json");
  EXPECT_FALSE(fs::exists(file(stale + "out")));
  EXPECT_TRUE(fs::exists(file(stale + "else"))) << "another folder's";
  EXPECT_TRUE(fs::exists(file(other))) << "of a process that lives";
}

TEST_F(Staged, RefusesAFile) {
  files::write_text(file("out"), "");
  const Error error = error_of([&] { files::StagedFolder(file("out"), "seal.json"); });
  EXPECT_EQ(error.kind(), ErrorKind::cannot_create);
  EXPECT_EQ(error.problem(), "is a file");
}

TEST_F(Staged, TakesNoFolderThatSomebodyElsePutThere) {
  fs::create_directories(file("." + std::to_string(::getpid()) + ".part.out"));
  const Error error = error_of([&] { files::StagedFolder(file("out"), "seal.json"); });
  EXPECT_EQ(error.kind(), ErrorKind::cannot_create);
  EXPECT_NE(error.problem().find("cannot make a folder to write in meanwhile: "), std::string::npos);
  EXPECT_EQ(fs::exists(file("." + std::to_string(::getpid()) + ".part.out")), true);
}

TEST_F(Staged, SaysWhatCannotBeMoved) {
  fs::create_directories(file("out/a.txt/in_the_way"));
  files::StagedFolder staged(file("out"), "seal.json");
  fill(staged, "1");
  EXPECT_NE(error_of([&] { staged.commit(); }).problem().find("cannot be moved into place: "),
            std::string::npos);
  EXPECT_FALSE(fs::exists(file("out/seal.json"))) << "not whole, and says so";
  EXPECT_NE(error_of([&] { files::files_within(file("none")); }).problem().find("cannot be listed: "),
            std::string::npos);
}

}  // namespace
}  // namespace ecorche::test
