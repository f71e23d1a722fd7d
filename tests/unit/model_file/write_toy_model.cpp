// SPDX-License-Identifier: Apache-2.0
// write_toy_model FILE.hdf [corrected]
#include <cstdio>
#include <string_view>

#include <ecorche/model_file/model_file.hpp>
#include "tests/support/toy_model.hpp"

int main(int argc, char** argv) {
  const bool corrected = argc == 3 && std::string_view(argv[2]) == "corrected";
  if (argc != 2 && !corrected) return 64;
  try {
    const ecorche::Model model =
        corrected ? ecorche::test::corrected_toy_model() : ecorche::test::toy_model();
    ecorche::model_file::write(model, argv[1], {});
    return 0;
  } catch (const ecorche::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return ecorche::exit_code(error.kind());
  }
}
