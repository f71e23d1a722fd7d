// SPDX-License-Identifier: Apache-2.0
// Values as YAML text that reads back as the same values.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

namespace ecorche::io::yaml {

/// The shortest decimal that reads back as exactly `value`.
std::string write_number(double value);
/// Radians as the shortest decimal in degrees that `Value::degrees` reads back as exactly `radians`.
std::string write_degrees(double radians);
/// `[x, y, z]`
std::string write_vector(const Eigen::Vector3d& v);
/// A word as it is where it is an identifier, else quoted.
std::string write_text(std::string_view text);

}  // namespace ecorche::io::yaml
