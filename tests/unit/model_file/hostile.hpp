// SPDX-License-Identifier: Apache-2.0
// A model for each test to spoil, and what reading it then says.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/support/forge.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/model_file/test_files.hpp"

namespace ecorche::test {

class Hostile : public ModelFileTest {
 protected:
  Hostile() { model_file::write(toy_model(), file("a.hdf"), {}); }
  const std::string& read_error(const std::function<void(Forge&)>& spoil) {
    {
      Forge forge(file("a.hdf"));
      spoil(forge);
    }
    const Error error = error_of([&] { model_file::read(file("a.hdf"), {}); });
    EXPECT_EQ(error.kind(), ErrorKind::data) << error.what();
    return text_ = error.what();
  }
  // The message says all of these.
  void expect_refused(const std::function<void(Forge&)>& spoil, const std::vector<std::string>& words) {
    const std::string error = read_error(spoil);
    for (const std::string& word : words) EXPECT_NE(error.find(word), std::string::npos) << error;
  }

 private:
  std::string text_;
};

inline const std::string kWeight = "/ecorche/weights/weight";

}  // namespace ecorche::test
