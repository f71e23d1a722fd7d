// SPDX-License-Identifier: Apache-2.0
// write_toy_model FILE.hdf [corrected|corrected_by_joints]
#include <cstdio>
#include <string_view>

#include <ecorche/model_file/model_file.hpp>
#include "tests/support/toy_model.hpp"

int main(int argc, char** argv) {
  const std::string_view word = argc == 3 ? argv[2] : "";
  if (argc > 3 || argc < 2 || (argc == 3 && word != "corrected" && word != "corrected_by_joints")) return 64;
  try {
    ecorche::Model model = argc == 3 ? ecorche::test::corrected_toy_model() : ecorche::test::toy_model();
    if (word == "corrected_by_joints") model.pose_corrections.clear();
    ecorche::model_file::write(model, argv[1], {});
    return 0;
  } catch (const ecorche::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return ecorche::exit_code(error.kind());
  }
}
