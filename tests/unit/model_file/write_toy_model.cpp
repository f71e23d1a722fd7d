// SPDX-License-Identifier: Apache-2.0
// write_toy_model FILE.hdf
#include <cstdio>

#include <ecorche/model_file/model_file.hpp>
#include "tests/support/toy_model.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 64;
  try {
    ecorche::model_file::write(ecorche::test::toy_model(), argv[1], {});
    return 0;
  } catch (const ecorche::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return ecorche::exit_code(error.kind());
  }
}
