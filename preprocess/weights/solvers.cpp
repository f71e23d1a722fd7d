// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "preprocess/weights/harmonic.hpp"
#ifdef ECORCHE_GPL
#include "preprocess/weights/cholmod/cholmod_solver.hpp"
#endif

namespace ecorche::weights {

std::vector<std::string_view> solver_names() {
#ifdef ECORCHE_GPL
  return {"cholmod", "amg", "eigen"};
#else
  return {"eigen", "amg"};
#endif
}

std::string_view solver_for(std::int64_t unknowns) {
  // bench/solvers/RESULTS.md: why here, and not where multigrid overtakes the factors.
#ifdef ECORCHE_GPL
  constexpr std::int64_t kFactored = 40'000;
#else
  constexpr std::int64_t kFactored = 20'000;
#endif
  return unknowns <= kFactored ? solver_names().front() : "amg";
}

std::unique_ptr<solve::SpdSolver> make_solver(std::string_view name) {
  if (name == "auto") name = solver_names().front();
#ifdef ECORCHE_GPL
  if (name == "cholmod") return make_cholmod_solver();
#endif
  if (name == "amg") return solve::make_multigrid_solver();
  if (name == "eigen") return solve::make_eigen_solver();
  std::string known = "auto";
  for (const std::string_view each : solver_names()) known.append(", ").append(each);
  throw Error(ErrorKind::usage, "--solver", "this build has no solver '" + std::string(name) + "'",
              "use one of " + known);
}

}  // namespace ecorche::weights
