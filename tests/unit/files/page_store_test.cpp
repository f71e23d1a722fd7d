// SPDX-License-Identifier: Apache-2.0
#include "core/files/page_store.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <ecorche/values/error.hpp>
#include "core/platform/heap.hpp"
#include "tests/unit/io/scratch.hpp"

namespace ecorche::files {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBytes = std::size_t{1} << 20;

// A folder in memory, gone at the end.
class InMemory {
 public:
  InMemory() {
    platform::use_tidy_heap();  // as servers do: arrays of kBytes lie alike
    std::string form = "/dev/shm/ecorche_test_XXXXXX";
    path_ = ::mkdtemp(form.data());
  }
  ~InMemory() { fs::remove_all(path_); }
  InMemory(const InMemory&) = delete;
  InMemory& operator=(const InMemory&) = delete;

  const fs::path& path() const { return path_; }
  std::vector<fs::path> files() const {
    std::vector<fs::path> out;
    for (const auto& entry : fs::directory_iterator(path_)) out.push_back(entry.path());
    std::sort(out.begin(), out.end());
    return out;
  }

 private:
  fs::path path_;
};

std::vector<std::byte> content(unsigned seed, std::size_t bytes = kBytes) {
  std::vector<std::byte> out(bytes);
  for (std::size_t i = 0; i < bytes; ++i) out[i] = static_cast<std::byte>((i * 2654435761U + seed) >> 13U);
  return out;
}

PageStore::Arrays arrays(const std::vector<std::byte>& one) {
  return {std::span<const std::byte>(one)};
}

// The file whose pages stand in the middle of the array; empty: none.
std::string file_behind(const std::vector<std::byte>& array) {
  std::ifstream maps("/proc/self/maps");
  const auto at = reinterpret_cast<std::uintptr_t>(array.data() + array.size() / 2);
  for (std::string line; std::getline(maps, line);) {
    std::uintptr_t low = 0, high = 0;
    if (std::sscanf(line.c_str(), "%zx-%zx", &low, &high) == 2 && low <= at && at < high)
      return line.find('/') == line.npos ? "" : line.substr(line.find('/'));
  }
  return "";
}

// In a process of its own; its exit code.
int in_child(const std::function<int()>& what) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(what());
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

TEST(PageStore, EqualArraysStandOnOneFile) {
  const InMemory folder;
  const PageStore store(folder.path());
  const std::vector<std::byte> truth = content(1), one = truth, other = truth;
  const PageStore::Copy a = store.share(arrays(one)), b = store.share(arrays(other));
  EXPECT_TRUE(a.made);
  EXPECT_FALSE(b.made);
  EXPECT_FALSE(a.error || b.error);
  // But for what is no whole page at both ends.
  EXPECT_GE(a.bytes, kBytes - 2 * platform::page_bytes());
  ASSERT_EQ(folder.files().size(), 1U);
  EXPECT_EQ(file_behind(one), folder.files().front());
  EXPECT_EQ(file_behind(other), folder.files().front());
  EXPECT_EQ(one, truth);
  EXPECT_EQ(other, truth);
}

TEST(PageStore, OtherArraysStandOnAnother) {
  const InMemory folder;
  const PageStore store(folder.path());
  const std::vector<std::byte> truth = content(1);
  std::vector<std::byte> one = truth, other = truth;
  other[kBytes / 2] ^= std::byte{1};
  const std::vector<std::byte> changed = other;
  const PageStore::Copy a = store.share(arrays(one)), b = store.share(arrays(other));
  EXPECT_TRUE(a.made && b.made);
  EXPECT_EQ(folder.files().size(), 2U);
  EXPECT_NE(file_behind(one), file_behind(other));
  EXPECT_EQ(one, truth);
  EXPECT_EQ(other, changed);
}

TEST(PageStore, WhoWritesHasACopyOfHisOwn) {
  const InMemory folder;
  const PageStore store(folder.path());
  const std::vector<std::byte> truth = content(1);
  std::vector<std::byte> one = truth, other = truth;
  const PageStore::Copy a = store.share(arrays(one)), b = store.share(arrays(other));
  std::fill(one.begin(), one.end(), std::byte{7});
  EXPECT_EQ(other, truth);
  std::vector<std::byte> third = truth;
  EXPECT_FALSE(store.share(arrays(third)).made);
  EXPECT_EQ(third, truth);
}

TEST(PageStore, MemoryMayBeUsedAgainForSomethingElse) {
  const InMemory folder;
  const PageStore store(folder.path());
  for (unsigned round = 0; round < 50; ++round) {
    const std::vector<std::byte> truth = content(round, 300'000);
    std::vector<std::byte> one = truth;
    const PageStore::Copy copy = store.share(arrays(one));
    ASSERT_TRUE(copy.made);
    one = {};  // before the copy's end, and its memory after
    const std::vector<std::byte> next = content(round + 1, 300'000), same = next;
    ASSERT_EQ(next, same);
  }
  EXPECT_TRUE(folder.files().empty());
}

// From a heap, say: whoever has an array elsewhere in its page has it for himself, and shares the others.
TEST(PageStore, AnArrayAtAnotherPlaceOfItsPage) {
  const std::vector<std::byte> truth = content(1), other = content(2);
  for (const bool odd_first : {true, false}) {
    SCOPED_TRACE(odd_first);
    const InMemory folder;
    const PageStore store(folder.path());
    std::vector<std::byte> moved(kBytes + 100);
    std::copy(truth.begin(), truth.end(), moved.begin() + 100);
    const std::span<const std::byte> odd = std::span<const std::byte>(moved).subspan(100, kBytes);
    const std::vector<std::byte> even = truth, one = other, two = other;
    const PageStore::Arrays odd_arrays{odd, one}, even_arrays{even, two};
    const PageStore::Copy a = store.share(odd_first ? odd_arrays : even_arrays);
    const PageStore::Copy b = store.share(odd_first ? even_arrays : odd_arrays);
    EXPECT_TRUE(a.made && !b.made && !a.error && !b.error);
    EXPECT_EQ(folder.files().size(), 1U);
    EXPECT_EQ(file_behind(moved), "");
    for (const auto* array : {&even, &one, &two}) EXPECT_EQ(file_behind(*array), folder.files().front());
    EXPECT_TRUE(std::equal(odd.begin(), odd.end(), truth.begin()));
    EXPECT_TRUE(even == truth && one == other && two == other);
  }
}

TEST(PageStore, SmallArraysStayWhereTheyAre) {
  const InMemory folder;
  const PageStore store(folder.path());
  const std::vector<std::byte> one = content(1, PageStore::least_bytes - 1);
  const PageStore::Copy copy = store.share({std::span<const std::byte>(one), std::span<const std::byte>()});
  EXPECT_EQ(copy.bytes, 0U);
  EXPECT_TRUE(folder.files().empty());
}

TEST(PageStore, OfTooManyTheLargest) {
  const InMemory folder;
  const PageStore store(folder.path());
  const std::vector<std::byte> small = content(1, PageStore::least_bytes), large = content(2);
  PageStore::Arrays all(PageStore::most_arrays, std::span<const std::byte>(small));
  all.emplace_back(large);
  const PageStore::Copy copy = store.share(all);
  EXPECT_FALSE(copy.error);
  EXPECT_LT(fs::file_size(folder.files().front()), PageStore::most_arrays * (small.size() + 1) + kBytes);
  EXPECT_EQ(file_behind(large), folder.files().front());
  EXPECT_EQ(large, content(2));
  EXPECT_EQ(small, content(1, small.size()));
}

TEST(PageStore, TheFileGoesWithItsLastUser) {
  const InMemory folder;
  const PageStore store(folder.path());
  const std::vector<std::byte> truth = content(1), one = truth, other = truth;
  {
    const PageStore::Copy a = store.share(arrays(one));
    { const PageStore::Copy b = store.share(arrays(other)); }
    EXPECT_EQ(folder.files().size(), 1U);
  }
  EXPECT_TRUE(folder.files().empty());
  EXPECT_EQ(one, truth);  // it stays on what has no name any more
  EXPECT_EQ(other, truth);
}

TEST(PageStore, WhatKilledProcessesLeftIsRemoved) {
  const InMemory folder;
  const std::vector<std::byte> old = content(1), fresh = content(2);
  const auto die = [&]() -> int {
    const PageStore store(folder.path());
    const PageStore::Copy copy = store.share(arrays(old));
    ::_exit(copy.made ? 0 : 1);
  };
  ASSERT_EQ(in_child(die), 0);
  ASSERT_EQ(folder.files().size(), 1U);
  const fs::path left = folder.files().front();
  std::ofstream(folder.path() / ".1.0123456789abcdef.part.x.pages") << "half";
  std::ofstream(folder.path() / "somebody's own") << "stays";
  const PageStore store(folder.path());
  const PageStore::Copy copy = store.share(arrays(fresh));
  EXPECT_FALSE(fs::exists(left));
  EXPECT_EQ(folder.files().size(), 2U);
  EXPECT_TRUE(fs::exists(folder.path() / "somebody's own"));
}

TEST(PageStore, WhatOthersHoldIsNot) {
  const InMemory folder;
  const std::vector<std::byte> one = content(1), other = content(2);
  const PageStore store(folder.path());
  const PageStore::Copy held = store.share(arrays(one));
  ASSERT_EQ(in_child([&] { return store.share(arrays(other)).made ? 0 : 1; }), 0);
  EXPECT_EQ(folder.files().size(), 1U);
}

TEST(PageStore, ManyAtOnceMakeOne) {
  const InMemory folder;
  const std::vector<std::byte> truth = content(1);
  for (int round = 0; round < 20; ++round) {
    const PageStore store(folder.path());
    std::vector<std::vector<std::byte>> each(8, truth);
    std::vector<PageStore::Copy> copies(each.size());
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < each.size(); ++i)
      threads.emplace_back([&, i] { copies[i] = store.share(arrays(each[i])); });
    for (std::thread& thread : threads) thread.join();
    ASSERT_EQ(folder.files().size(), 1U);
    EXPECT_EQ(std::count_if(copies.begin(), copies.end(), [](const auto& copy) { return copy.made; }), 1);
    for (std::size_t i = 0; i < each.size(); ++i) {
      ASSERT_FALSE(copies[i].error) << copies[i].error.message();
      ASSERT_EQ(each[i], truth);
      ASSERT_EQ(file_behind(each[i]), folder.files().front());
    }
  }
}

// What stands under the name that this content has, and is not it: never believed, and put right.
TEST(PageStore, AHostileFileIsNotTaken) {
  const std::vector<std::byte> truth = content(1);
  std::string name;
  std::uint64_t size = 0;
  {
    const InMemory folder;
    std::vector<std::byte> one = truth;
    const PageStore::Copy copy = PageStore(folder.path()).share(arrays(one));
    name = folder.files().front().filename();
    size = fs::file_size(folder.files().front());
  }
  const auto write = [&](const fs::path& at, std::uint64_t bytes, ::mode_t mode) {
    // The right content, so that it would be taken but for what the case changes.
    const InMemory good;
    const std::vector<std::byte> one = truth;
    const PageStore::Copy copy = PageStore(good.path()).share(arrays(one));
    std::ifstream in(good.files().front(), std::ios::binary);
    std::string all((std::istreambuf_iterator<char>(in)), {});
    all.resize(bytes);
    std::ofstream(at, std::ios::binary) << all;
    ::chmod(at.c_str(), mode);
  };
  const auto flip = [&](const fs::path& at, std::uint64_t offset) {
    write(at, size, 0600);
    std::fstream file(at, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(static_cast<std::streamoff>(offset));
    const char byte = static_cast<char>(file.get() ^ 1);
    file.seekp(static_cast<std::streamoff>(offset));
    file.put(byte);
    file.close();
    ::chmod(at.c_str(), 0400);
  };
  const std::pair<const char*, std::function<void(const fs::path&)>> cases[] = {
      {"first byte flipped", [&](const fs::path& at) { flip(at, 0); }},
      {"first byte of the array's flipped", [&](const fs::path& at) { flip(at, platform::page_bytes()); }},
      {"last byte of the array's flipped",
       [&](const fs::path& at) { flip(at, size - platform::page_bytes() - 1); }},
      {"truncated", [&](const fs::path& at) { write(at, size - 1, 0400); }},
      {"truncated to a page", [&](const fs::path& at) { write(at, platform::page_bytes(), 0400); }},
      {"empty", [&](const fs::path& at) { write(at, 0, 0400); }},
      {"longer", [&](const fs::path& at) { write(at, size + 1, 0400); }},
      {"may be written by its owner", [&](const fs::path& at) { write(at, size, 0600); }},
      {"may be written by others", [&](const fs::path& at) { write(at, size, 0446); }},
      {"a link to the right content",
       [&](const fs::path& at) {
         write(at.parent_path() / "elsewhere", size, 0400);
         fs::create_symlink("elsewhere", at);
       }},
      {"a pipe", [&](const fs::path& at) { ::mkfifo(at.c_str(), 0400); }},
      {"another user's",
       [&](const fs::path& at) {
         write(at, size, 0400);
         ASSERT_EQ(::chown(at.c_str(), 65534, 65534), ::geteuid() == 0 ? 0 : -1);
       }},
  };
  for (const auto& [what, put] : cases) {
    SCOPED_TRACE(what);
    const InMemory folder;
    put(folder.path() / name);
    if (what == std::string("another user's") && ::geteuid() != 0) continue;
    const PageStore store(folder.path());
    const std::vector<std::byte> one = truth, other = truth;
    const PageStore::Copy a = store.share(arrays(one)), b = store.share(arrays(other));
    EXPECT_TRUE(a.made);
    EXPECT_FALSE(b.made);
    EXPECT_EQ(one, truth);
    EXPECT_EQ(other, truth);
    EXPECT_EQ(file_behind(one), folder.path() / name);
  }
  // A folder cannot be put out of the way when something is in it: each keeps his own.
  const InMemory folder;
  fs::create_directories(folder.path() / name / "within");
  const std::vector<std::byte> one = truth;
  const PageStore::Copy copy = PageStore(folder.path()).share(arrays(one));
  EXPECT_TRUE(copy.error);
  EXPECT_EQ(copy.bytes, 0U);
  EXPECT_EQ(one, truth);
  EXPECT_EQ(file_behind(one), "");
}

TEST(PageStore, AFullDiskLeavesArraysAsTheyWere) {
  const InMemory folder;
  const auto run = [&] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{kBytes / 2, kBytes / 2};
    if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) return 2;
    const std::vector<std::byte> truth = content(1), first = content(2, kBytes / 4), one = truth;
    const PageStore::Copy copy =
        PageStore(folder.path()).share({std::span<const std::byte>(first), std::span<const std::byte>(one)});
    return copy.error == std::errc::file_too_large && copy.bytes == 0 && one == truth &&
                   first == content(2, kBytes / 4)
               ? 0
               : 1;
  };
  EXPECT_EQ(in_child(run), 0);
  EXPECT_TRUE(folder.files().empty());
}

TEST(PageStore, OnlyAFolderOfOnesOwnInMemory) {
  const auto refused = [](const fs::path& folder) -> std::optional<Error> {
    try {
      const PageStore store(folder);
    } catch (const Error& error) {
      return error;
    }
    return std::nullopt;
  };
  const InMemory memory;
  EXPECT_FALSE(refused(memory.path() / "new"));
  struct stat made {};
  ASSERT_EQ(::stat((memory.path() / "new").c_str(), &made), 0);
  EXPECT_EQ(made.st_mode & 0777U, 0700U);

  fs::create_directory(memory.path() / "open");
  ::chmod((memory.path() / "open").c_str(), 0770);
  ASSERT_TRUE(refused(memory.path() / "open"));
  EXPECT_EQ(refused(memory.path() / "open")->kind(), ErrorKind::refused);
  EXPECT_EQ(refused(memory.path() / "open")->problem(), "is another user's, or others may write into it");

  fs::create_symlink("new", memory.path() / "link");
  ASSERT_TRUE(refused(memory.path() / "link"));
  EXPECT_EQ(refused(memory.path() / "link")->kind(), ErrorKind::cannot_create);
  EXPECT_EQ(refused(memory.path() / "link")->problem(), "cannot be used: Not a directory");
  EXPECT_TRUE(refused(memory.path() / "not" / "there"));

  if (::geteuid() == 0) {
    fs::create_directory(memory.path() / "theirs");
    ASSERT_EQ(::chown((memory.path() / "theirs").c_str(), 65534, 65534), 0);
    EXPECT_TRUE(refused(memory.path() / "theirs"));
  }
  const Scratch disk;
  if (!platform::cannot_keep_pages_in(disk.path())) return;  // its folder is in memory, too
  ASSERT_TRUE(refused(disk.path()));
  EXPECT_EQ(refused(disk.path())->problem(), "is on a disk");
}

}  // namespace
}  // namespace ecorche::files
