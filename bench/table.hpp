// SPDX-License-Identifier: Apache-2.0
// Tables that read in a terminal and are Markdown, row by row as they come: of all benches in C++.
#pragma once

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

namespace ecorche::bench {

struct Column {
  std::string title;
  int width = 0;  ///< at least so wide; below 0: to the left
};

class Table {
 public:
  /// Prints the head. The first column is to the left in any case.
  explicit Table(std::vector<Column> columns) {
    std::vector<std::string> titles;
    std::string rule = "|";
    for (Column& column : columns) {
      const bool left = widths_.empty() || column.width < 0;
      const int width = std::max({std::abs(column.width), static_cast<int>(column.title.size()), 3});
      widths_.push_back(left ? -width : width);
      titles.push_back(std::move(column.title));
      rule += std::string(static_cast<std::size_t>(width) + 1, '-') + (left ? "-|" : ":|");
    }
    std::printf("\n");
    row(titles);
    std::printf("%s\n", rule.c_str());
  }

  void row(const std::vector<std::string>& cells) const {
    for (std::size_t c = 0; c < widths_.size(); ++c)
      std::printf("%s%*s", c == 0 ? "| " : " | ", widths_[c], c < cells.size() ? cells[c].c_str() : "");
    std::printf(" |\n");
    std::fflush(stdout);
  }

 private:
  std::vector<int> widths_;
};

/// Below a table: whatever is not of its columns.
inline void print_notes(const std::vector<std::string>& notes) {
  for (std::size_t n = 0; n < notes.size(); ++n)
    std::printf("%s- %s\n", n == 0 ? "\n" : "", notes[n].c_str());
  std::fflush(stdout);
}

/// As "%.DIGITSf".
inline std::string fixed(double value, int digits) {
  char out[400];
  std::snprintf(out, sizeof out, "%.*f", digits, value);
  return out;
}

/// As "%.DIGITSe".
inline std::string exponent(double value, int digits) {
  char out[40];
  std::snprintf(out, sizeof out, "%.*e", digits, value);
  return out;
}

}  // namespace ecorche::bench
