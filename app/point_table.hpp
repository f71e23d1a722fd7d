// SPDX-License-Identifier: Apache-2.0
// Points from a CSV file, and tables into one.
#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace ecorche::app {

/// 3 * #points, LPS mm. The first line may name the columns: x, y and z are read, others left alone. Without
/// it a line is three numbers. Empty lines and those that begin with # are skipped. Throws
/// Error{missing_input} for a file that cannot be read, Error{data} with the line for what is no point, or
/// where there is none.
std::vector<float> read_points(const std::filesystem::path& path);

/// A point with what a table says of it: no more than it has columns for.
struct NamedPoint {
  std::string name, parent;
  std::array<double, 3> at{};  ///< LPS mm
};

/// As read_points, with the columns `name` and `parent` where the first line names them. Names are of a-z,
/// 0-9 and _, 64 at most, or empty; another is Error{data} with the line.
std::vector<NamedPoint> read_named_points(const std::filesystem::path& path);

/// Lines of cells with commas between: `columns`, then `rows`; null is an empty cell. Cells with a comma or a
/// quote are quoted.
std::string csv_of(const nlohmann::json& columns, const nlohmann::json& rows);

}  // namespace ecorche::app
