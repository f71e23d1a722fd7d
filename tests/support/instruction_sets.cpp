// SPDX-License-Identifier: Apache-2.0
#define HWY_WANT_AVX3_DL  // the probe has kernels of its own for it
#include "tests/support/instruction_sets.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

namespace ecorche::test {

std::vector<std::string> instruction_sets() {
  std::vector<std::string> out;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets())
    out.emplace_back(hwy::TargetName(target));
  return out;
}

void for_instruction_sets(const std::function<void()>& check) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    SCOPED_TRACE(hwy::TargetName(target));
    check();
  }
  hwy::SetSupportedTargetsForTest(0);
}

}  // namespace ecorche::test
