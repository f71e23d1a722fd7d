// SPDX-License-Identifier: Apache-2.0
// Kernels are compiled once per instruction set: tests run them with each.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace ecorche::test {

/// Those that kernels were compiled for and this machine has, by Highway's names, the best one first.
std::vector<std::string> instruction_sets();

/// Calls `check` with kernels held to each of them in turn, whose name stands in what it reports; afterwards
/// kernels choose for themselves again.
void for_instruction_sets(const std::function<void()>& check);

}  // namespace ecorche::test
