// SPDX-License-Identifier: Apache-2.0
#include "core/files/atomic_file.hpp"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <sys/random.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <optional>
#include <regex>

#include "core/files/scratch_folder.hpp"
#include "core/files/stale_parts.hpp"
#include "tests/unit/io/scratch.hpp"

namespace {
std::optional<unsigned char> every_byte;  // of what the kernel's dice show
}

// Seen by all libraries of the process, though ours show nothing.
#pragma GCC visibility push(default)
extern "C" ssize_t getrandom(void* to, std::size_t size, unsigned flags) {
  using Real = ssize_t (*)(void*, std::size_t, unsigned);
  static const auto real = reinterpret_cast<Real>(dlsym(RTLD_NEXT, "getrandom"));
  if (!every_byte) return real(to, size, flags);
  std::memset(to, *every_byte, size);
  return static_cast<ssize_t>(size);
}
#pragma GCC visibility pop

namespace ecorche::files {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> out;
  for (const auto& entry : fs::directory_iterator(folder)) out.push_back(entry.path().filename().string());
  std::sort(out.begin(), out.end());
  return out;
}

TEST(AtomicFile, ItsTemporaryIsNewAndCannotBeGuessed) {
  const Scratch scratch;
  const AtomicFile one(scratch / "a.nii.gz"), other(scratch / "a.nii.gz");
  EXPECT_NE(one.temporary(), other.temporary());
  const std::regex form("\\." + std::to_string(::getpid()) + "\\.[0-9a-f]{16}\\.part\\.a\\.nii\\.gz");
  EXPECT_TRUE(std::regex_match(one.temporary().filename().string(), form)) << one.temporary();
  EXPECT_EQ(fs::file_size(one.temporary()), 0U);
}

// Had somebody guessed it: what their link points at is not written to.
TEST(AtomicFile, NothingThatIsThereIsOpened) {
  const Scratch scratch;
  const fs::path victim = scratch.put("victim", "mine");
  const fs::path guessed = scratch / ("." + std::to_string(::getpid()) + ".0707070707070707.part.a.txt");
  every_byte = 7;
  fs::create_symlink(victim, guessed);
  expect_error(ErrorKind::cannot_create, "a.txt: cannot write here: File exists",
               [&] { write_text(scratch / "a.txt", "theirs"); });
  fs::remove(guessed);
  fs::create_hard_link(victim, guessed);
  expect_error(ErrorKind::cannot_create, "a.txt: cannot write here: File exists",
               [&] { write_text(scratch / "a.txt", "theirs"); });
  fs::remove(guessed);
  write_text(scratch / "a.txt", "theirs");
  every_byte.reset();
  EXPECT_EQ(scratch.get("victim"), "mine");
  EXPECT_EQ(scratch.get("a.txt"), "theirs");
  EXPECT_EQ(names_in(scratch.path()), (std::vector<std::string>{"a.txt", "victim"}));
}

TEST(AtomicFile, TwoAppearTogetherOrNeither) {
  const Scratch scratch;
  const auto write = [&](const std::string& text, auto&& before_commit) {
    AtomicFile one(scratch / "a.node"), other(scratch / "a.ele");
    write_text(one, text + " nodes");
    write_text(other, text + " tets");
    before_commit(other);
    const std::array both{&one, &other};
    commit_together(both);
  };
  const auto nothing = [](const AtomicFile&) {};
  // A folder takes the second name while the files are written: nothing appears.
  expect_error(ErrorKind::io, "a.ele: cannot rename: ", [&] {
    write("first", [](const AtomicFile& file) { fs::create_directory(file.path()); });
  });
  EXPECT_EQ(names_in(scratch.path()), std::vector<std::string>{"a.ele"});
  fs::remove(scratch / "a.ele");
  write("first", nothing);
  EXPECT_EQ(scratch.get("a.node") + scratch.get("a.ele"), "first nodesfirst tets");
  // What stood there stands there again.
  expect_error(ErrorKind::io, "a.ele: cannot rename: ", [&] {
    write("second", [](const AtomicFile& file) {
      fs::remove(file.path());
      fs::create_directory(file.path());
    });
  });
  EXPECT_EQ(scratch.get("a.node"), "first nodes");
  fs::remove(scratch / "a.ele");
  expect_error(ErrorKind::io, "a.ele: cannot flush: ", [&] {
    write("third", [](const AtomicFile& file) { fs::remove(file.temporary()); });
  });
  EXPECT_EQ(names_in(scratch.path()), std::vector<std::string>{"a.node"});
  write("fourth", nothing);
  EXPECT_EQ(scratch.get("a.node") + scratch.get("a.ele"), "fourth nodesfourth tets");
  EXPECT_EQ(names_in(scratch.path()), (std::vector<std::string>{"a.ele", "a.node"}));
}

TEST(StaleParts, OfProcessesThatEndedAreSwept) {
  const Scratch scratch;
  const ::pid_t ended = ::fork();
  if (ended == 0) ::_exit(0);
  ASSERT_EQ(::waitpid(ended, nullptr, 0), ended);
  const std::string dead = "." + std::to_string(ended);
  const AtomicFile living(scratch / "m.hdf");
  scratch.put(dead + ".part.m.hdf", "old");
  scratch.put(dead + ".0123456789abcdef.part.m.hdf", "new");
  const std::vector<std::string> kept{dead + ".0123456789abcdef.part.other.hdf",
                                      dead + ".0123456789abcdeg.part.m.hdf", dead + ".0123456789abcdef.m.hdf",
                                      ".x.0123456789abcdef.part.m.hdf"};
  for (const std::string& name : kept) scratch.put(name, "mine");
  remove_stale_parts(scratch.path(), "m.hdf");
  EXPECT_FALSE(fs::exists(scratch / (dead + ".part.m.hdf")));
  EXPECT_FALSE(fs::exists(scratch / (dead + ".0123456789abcdef.part.m.hdf")));
  EXPECT_TRUE(fs::exists(living.temporary()));
  for (const std::string& name : kept) EXPECT_TRUE(fs::exists(scratch / name)) << name;
  remove_stale_parts_ending(scratch.path(), ".hdf");
  EXPECT_FALSE(fs::exists(scratch / kept[0]));
}

TEST(ScratchFolder, IsHiddenBesideItsTargetAndGoesWithWhatIsInIt) {
  const Scratch scratch;
  fs::path was;
  for (const char* target : {"posed", "posed/", "posed/.", "deep/er/posed"}) {
    const ScratchFolder folder(scratch / target);
    was = folder.path();
    const std::regex form("\\." + std::to_string(::getpid()) + "\\.[0-9a-f]{16}\\.part\\.posed");
    EXPECT_TRUE(std::regex_match(was.filename().string(), form)) << was;
    EXPECT_EQ(was.parent_path(), target[0] == 'd' ? scratch / "deep" / "er" : fs::path(scratch.path()))
        << target;
    EXPECT_EQ(fs::status(was).permissions(), fs::perms::owner_all);
    fs::create_directories(was / "patient");
    std::ofstream(was / "patient" / "ct.nrrd") << "voxels";
    EXPECT_TRUE(fs::exists(was));
  }
  EXPECT_EQ(names_in(scratch.path()), std::vector<std::string>{"deep"});
}

TEST(ScratchFolder, SweepsThoseOfProcessesThatEnded) {
  const Scratch scratch;
  const ::pid_t ended = ::fork();
  if (ended == 0) ::_exit(0);
  ASSERT_EQ(::waitpid(ended, nullptr, 0), ended);
  const std::string dead = "." + std::to_string(ended) + ".0123456789abcdef.part.";
  fs::create_directories(scratch / (dead + "posed") / "patient");
  fs::create_directories(scratch / (dead + "other"));
  { const ScratchFolder folder(scratch / "posed"); }
  EXPECT_EQ(names_in(scratch.path()), std::vector<std::string>{dead + "other"});
}

TEST(ScratchFolder, TakesNoneThatIsThere) {
  const Scratch scratch;
  const fs::path guessed = scratch / ("." + std::to_string(::getpid()) + ".0707070707070707.part.posed");
  fs::create_directories(guessed / "somebody_elses");
  every_byte = 7;
  try {
    const ScratchFolder folder(scratch / "posed");
    ADD_FAILURE() << "was made";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::cannot_create);
    EXPECT_NE(error.problem().find("cannot make a folder to write in meanwhile: File exists"),
              std::string::npos)
        << error.what();
  }
  every_byte.reset();
  EXPECT_TRUE(fs::exists(guessed / "somebody_elses"));
}

}  // namespace
}  // namespace ecorche::files
