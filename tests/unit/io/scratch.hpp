// SPDX-License-Identifier: Apache-2.0
// What the tests of readers and writers share: a folder for a test, and the error that a call throws.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/values/error.hpp>
#include "core/files/read_options.hpp"

namespace ecorche {

/// A folder that goes away with the test.
class Scratch {
 public:
  Scratch() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() /
            ("ecorche_io_" + std::to_string(::getpid()) + "_" + test->test_suite_name() + "_" + test->name());
    std::filesystem::create_directories(path_);
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

  /// Writes `bytes` under `name`, making folders.
  std::filesystem::path put(const std::string& name, const std::string& bytes) const {
    std::filesystem::path file = path_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
  }
  std::string get(const std::string& name) const {
    std::ifstream file(path_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

 private:
  std::filesystem::path path_;
};

/// What a reader tells, line by line.
struct Said {
  std::vector<std::string> lines;
  files::ReadOptions options{{}, [this](std::string_view line) { lines.emplace_back(line); }};
};

/// The Error that `f` throws; anything else fails the test.
template <class F>
std::optional<Error> error_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "nothing was thrown";
  return std::nullopt;
}

/// Asserts the kind and that the line holds `part`.
template <class F>
void expect_error(ErrorKind kind, const std::string& part, F&& f) {
  const auto error = error_of(std::forward<F>(f));
  if (!error) return;
  EXPECT_EQ(static_cast<int>(error->kind()), static_cast<int>(kind)) << error->what();
  EXPECT_NE(std::string(error->what()).find(part), std::string::npos)
      << "got:  " << error->what() << "\nwant: " << part;
}

}  // namespace ecorche
