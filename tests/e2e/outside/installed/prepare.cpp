// SPDX-License-Identifier: Apache-2.0
// prepare CASE MODEL.hdf: from a case to a model.
#include <cstdio>
#include <ecorche/io/case_file.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/preprocess/pipeline.hpp>

int main(int, char** argv) try {
  const ecorche::Context context;
  const ecorche::Case patient = ecorche::io::read_case(argv[1], {}, context);
  ecorche::preprocess::Options options;
  options.max_tets = 30'000;
  const ecorche::preprocess::Result made = ecorche::preprocess::run(patient, options, context);
  ecorche::model_file::write(made.model, argv[2], context);
  std::printf("%zu tets\n", static_cast<std::size_t>(made.model.tets.rows()));
  return 0;
} catch (const ecorche::Error& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return 1;
}
