// SPDX-License-Identifier: Apache-2.0
// How stiff a case says that flesh is.
#pragma once

#include <ecorche/values/case.hpp>
#include "io/case/yaml_reader.hpp"

namespace ecorche::io {

/// A `stiffness_kpa`: Young's modulus, 0.01 to 1 000 000 kPa. Throws Error{config}.
double read_stiffness(const yaml::Value& value);

/// That of an entry of several tissues, `patient`'s from row `first` on: a number for all of them, or one a
/// group, of which each must have a tissue. Throws Error{config}.
void read_stiffness_of_groups(const yaml::Value& value, std::size_t first, Case& patient);

/// Of the whole case, whose tissues are read: `value` may be absent only where no tissue says its own.
void read_stiffness_of_flesh(const yaml::Value& root, Case& patient);

}  // namespace ecorche::io
