// SPDX-License-Identifier: Apache-2.0
// A folder for one test, models compared member by member, and files as bytes.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include <ecorche/model_file/model_file.hpp>

namespace ecorche::test {

/// A fresh folder that goes away with the test.
class ModelFileTest : public ::testing::Test {
 protected:
  ModelFileTest();
  ~ModelFileTest() override;
  std::filesystem::path file(const std::string& name) const { return folder_ / name; }
  const std::filesystem::path& folder() const { return folder_; }
  /// Names in the folder, sorted.
  std::vector<std::string> names() const;

 private:
  std::filesystem::path folder_;
};

using Bytes = std::vector<char>;
Bytes load(const std::filesystem::path& path);
void store(const std::filesystem::path& path, const Bytes& bytes);

/// A toy model with every optional member in use: couplings, infinite limits, fits, a label volume of two
/// components, text beyond ASCII.
Model full_model();

/// Every member of `a` and `b` is the same, bit by bit; says which is not.
void expect_same(const Model& a, const Model& b);

/// The error that `f` throws; fails the test when it throws none.
template <class F>
Error error_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error was thrown";
  return {ErrorKind::internal, "", "", ""};
}

}  // namespace ecorche::test
