// SPDX-License-Identifier: Apache-2.0
#include "core/solve/wide_rows.hpp"

#include <gtest/gtest.h>

#include <random>

namespace ecorche::solve {
namespace {

constexpr std::size_t kRows = 37;

Wide random_rows(std::size_t rows, std::size_t width, unsigned seed) {
  std::mt19937 random(seed);
  Wide out(rows * width);
  for (float& value : out) value = static_cast<float>(random() % 2001) / 1000 - 1;
  return out;
}

Csr<float> random_matrix() {
  std::mt19937 random(7);
  Csr<float> out;
  out.rows = out.columns = kRows;
  for (std::size_t row = 0; row < kRows; ++row) {
    for (std::int32_t column = 0; column < static_cast<std::int32_t>(kRows); ++column) {
      if (random() % 5 != 0) continue;
      out.column.push_back(column);
      out.value.push_back(static_cast<float>(random() % 100) / 50 - 1);
    }
    out.first.push_back(static_cast<std::int64_t>(out.column.size()));
  }
  return out;
}

// Every width that a block may have; rows before `begin` and from `end` on are left alone.
TEST(WideRows, ProductsAndAddendsAreThoseOfPlainLoops) {
  const Csr<float> A = random_matrix();
  for (std::size_t width = kLanes; width <= kMostColumns; width += kLanes) {
    const Wide x = random_rows(kRows, width, 1), u = random_rows(kRows, width, 2),
               v = random_rows(kRows, width, 3), w = random_rows(kRows, width, 4);
    for (std::size_t given = 0; given <= 3; ++given) {
      Combination job{&A, x.data(), -0.75F, {}, nullptr, width};
      const std::array<Combination::Addend, 3> addends{{{u.data(), 2}, {v.data(), -0.5F}, {w.data(), 3}}};
      std::copy_n(addends.begin(), given, job.addends.begin());
      Wide out = u;  // rows of an addend may be written to
      if (given > 0) job.addends[0].rows = out.data();
      job.out = out.data();
      combine(job, 3, kRows - 2);
      for (std::size_t row = 0; row < kRows; ++row) {
        for (std::size_t c = 0; c < width; ++c) {
          const std::size_t at = row * width + c;
          if (row < 3 || row >= kRows - 2) {
            EXPECT_EQ(out[at], u[at]);
            continue;
          }
          double sum = 0;
          A.for_row(static_cast<std::int32_t>(row), [&](std::int32_t column, float a) {
            sum +=
                static_cast<double>(a) * static_cast<double>(x[static_cast<std::size_t>(column) * width + c]);
          });
          sum *= -0.75;
          for (std::size_t i = 0; i < given; ++i) {
            const float* const rows = i == 0 ? u.data() : addends[i].rows;
            sum += static_cast<double>(addends[i].times) * static_cast<double>(rows[at]);
          }
          EXPECT_NEAR(out[at], sum, 1e-5) << width << " " << given << " " << row << " " << c;
        }
      }
    }
  }
}

TEST(WideRows, StepsAndSumsAreThoseOfPlainLoops) {
  for (std::size_t width = kLanes; width <= kMostColumns; width += kLanes) {
    const Wide p = random_rows(kRows, width, 1), q = random_rows(kRows, width, 2),
               before_x = random_rows(kRows, width, 3), before_r = random_rows(kRows, width, 4),
               factor = random_rows(1, width, 5);
    Wide x = before_x, r = before_r, turned = p;
    advance(factor.data(), p.data(), q.data(), x.data(), r.data(), width, 2, kRows);
    turn(factor.data(), q.data(), turned.data(), width, 0, kRows - 1);
    std::vector<double> sums(width, 0.25), expected(width, 0.25);
    add_dots(p.data(), q.data(), width, 1, kRows, sums.data());
    for (std::size_t row = 0; row < kRows; ++row) {
      for (std::size_t c = 0; c < width; ++c) {
        const std::size_t at = row * width + c;
        const float a = row < 2 ? 0 : factor[c];
        EXPECT_NEAR(x[at], before_x[at] + a * p[at], 1e-6);
        EXPECT_NEAR(r[at], before_r[at] - a * q[at], 1e-6);
        EXPECT_NEAR(turned[at], row + 1 < kRows ? q[at] + factor[c] * p[at] : p[at], 1e-6);
        if (row > 0) expected[c] += static_cast<double>(p[at]) * static_cast<double>(q[at]);
      }
    }
    for (std::size_t c = 0; c < width; ++c) EXPECT_NEAR(sums[c], expected[c], 1e-4);
  }
}

}  // namespace
}  // namespace ecorche::solve
