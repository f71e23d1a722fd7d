// SPDX-License-Identifier: Apache-2.0
#include "core/platform/file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <string>

#include "tests/unit/io/scratch.hpp"

namespace ecorche::platform {
namespace {

namespace fs = std::filesystem;

std::string read_whole(const File& file) {
  std::error_code error;
  std::string out(file.size(error), ' ');
  EXPECT_FALSE(error) << error.message();
  EXPECT_EQ(file.read_at(0, std::as_writable_bytes(std::span(out)), error), out.size());
  EXPECT_FALSE(error) << error.message();
  return out;
}

TEST(File, IsMadeWhereNothingStands) {
  const Scratch scratch;
  std::error_code error;
  File file(scratch / "a", Open::make, error);
  ASSERT_TRUE(file.is_open() && !error) << error.message();
  file.write("text", error);
  EXPECT_FALSE(error);
  EXPECT_EQ(read_whole(File(scratch / "a", Open::read, error)), "text");

  const fs::path victim = scratch.put("victim", "mine");
  fs::create_symlink(victim, scratch / "link");
  fs::create_symlink(scratch / "nowhere", scratch / "dangling");
  for (const char* const taken : {"a", "link", "dangling"}) {
    for (const Open how : {Open::make, Open::make_to_append}) {
      EXPECT_FALSE(File(scratch / taken, how, error).is_open());
      EXPECT_EQ(error, std::errc::file_exists) << taken;
    }
  }
  EXPECT_FALSE(fs::exists(scratch / "nowhere"));
}

TEST(File, WhatOthersMayDoIsTheMasksToSay) {
  const Scratch scratch;
  const mode_t before = umask(0);
  std::error_code error;
  const File plain(scratch / "plain", Open::make, error),
      appended(scratch / "appended", Open::make_to_append, error);
  umask(before);
  struct stat status {};
  ASSERT_EQ(stat((scratch / "plain").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0666U);
  ASSERT_EQ(stat((scratch / "appended").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0644U);
}

TEST(File, IsNotInherited) {
  const Scratch scratch;
  scratch.put("a", "text");
  std::error_code error;
  const int before = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  ::close(before);
  const File file(scratch / "a", Open::read, error);  // takes the descriptor that was free
  EXPECT_TRUE(file.is_same(before));
  EXPECT_EQ(fcntl(before, F_GETFD) & FD_CLOEXEC, FD_CLOEXEC);
}

TEST(File, AppendsBehindWhatOthersWrote) {
  const Scratch scratch;
  std::error_code error;
  File file(scratch / "a", Open::make_to_append, error);
  file.write("one ", error);
  File other(scratch / "a", Open::write, error);
  other.write("longer than one ", error);
  file.write("two", error);
  EXPECT_FALSE(error);
  EXPECT_EQ(read_whole(File(scratch / "a", Open::read, error)), "longer than one two");
}

TEST(File, ReadsFromAnyPlace) {
  const Scratch scratch;
  std::error_code error;
  const File file(scratch.put("a", "0123456789"), Open::read, error);
  std::array<std::byte, 4> some{};
  EXPECT_EQ(file.read_at(8, some, error), 2U);
  EXPECT_EQ(some[0], std::byte{'8'});
  EXPECT_EQ(file.read_at(10, some, error), 0U);
  EXPECT_FALSE(error);
  EXPECT_EQ(File().read_at(0, some, error), 0U);
  EXPECT_TRUE(error);
}

TEST(File, KnowsItself) {
  const Scratch scratch;
  std::error_code error;
  const File one(scratch.put("a", "text"), Open::read, error);
  const int again = ::open((scratch / "a").c_str(), O_RDONLY),
            other = ::open(scratch.put("b", "text").c_str(), O_RDONLY);
  EXPECT_TRUE(one.is_same(again));
  EXPECT_FALSE(one.is_same(other));
  EXPECT_FALSE(one.is_same(-1));
  ::close(again);
  ::close(other);
}

TEST(File, WaitsForNoWriterOfAPipe) {
  const Scratch scratch;
  ASSERT_EQ(mkfifo((scratch / "pipe").c_str(), 0666), 0);
  std::error_code error;
  const File pipe(scratch / "pipe", Open::read, error);
  EXPECT_TRUE(pipe.is_open());
  EXPECT_FALSE(pipe.is_regular());
  EXPECT_FALSE(File(scratch.path(), Open::read, error).is_regular());
  EXPECT_TRUE(File(scratch.put("a", ""), Open::read, error).is_regular());
}

TEST(File, KeepsRoomAndGivesItBack) {
  const Scratch scratch;
  std::error_code error;
  File file(scratch.put("a", "text"), Open::write, error);
  EXPECT_FALSE(file.reserve(4, 100));
  EXPECT_EQ(file.size(error), 104U);
  EXPECT_FALSE(file.resize(4));
  EXPECT_FALSE(file.flush());
  EXPECT_EQ(read_whole(File(scratch / "a", Open::read, error)), "text");
  EXPECT_FALSE(flush(scratch / "a"));
  EXPECT_FALSE(flush(scratch.path()));
  EXPECT_EQ(flush(scratch / "none"), std::errc::no_such_file_or_directory);
}

TEST(File, TellsThatNoMoreFits) {
  const Scratch scratch;
  std::error_code error;
  File file(scratch.put("a", "text"), Open::write, error);
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
  const rlimit small{.rlim_cur = 1000, .rlim_max = limit.rlim_max};
  const auto before = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::error_code full = file.reserve(4, 2000);
  file.write(std::string(2000, 'x'), error);
  setrlimit(RLIMIT_FSIZE, &limit);
  std::signal(SIGXFSZ, before);
  EXPECT_TRUE(is_full(full)) << full.message();
  EXPECT_TRUE(is_full(error)) << error.message();
  EXPECT_TRUE(is_full(std::make_error_code(std::errc::no_space_on_device)));
  EXPECT_FALSE(is_full(std::make_error_code(std::errc::permission_denied)));
  EXPECT_FALSE(is_full({}));
}

TEST(File, MovesToItsNewOwner) {
  const Scratch scratch;
  std::error_code error;
  File one(scratch.put("a", "text"), Open::read, error), other = std::move(one);
  EXPECT_FALSE(one.is_open());  // NOLINT(bugprone-use-after-move): that is what is asked
  EXPECT_EQ(read_whole(other), "text");
}

TEST(Folder, NothingIsMadeWhereThereIsNone) {
  const Scratch scratch;
  EXPECT_FALSE(cannot_make_in(scratch.path()));
  EXPECT_EQ(cannot_make_in(scratch / "none"), std::errc::no_such_file_or_directory);
}

}  // namespace
}  // namespace ecorche::platform
