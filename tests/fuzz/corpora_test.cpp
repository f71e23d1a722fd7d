// SPDX-License-Identifier: Apache-2.0
// The kept corpora, whole, cut at every length and with bytes turned, through every target.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "tests/fuzz/peak_bytes.hpp"
#include "tests/fuzz/targets.hpp"

namespace ecorche::fuzz {
namespace {

void run(const Target& target, const std::string& bytes) {
  target.run(std::as_bytes(std::span(bytes)));
}

// Every byte, but where each reading is a file written and read by a library: fewer of them.
std::size_t step_of(const std::string& target, std::size_t size) {
  if (target == "model" || target == "model_parts") return 1 + size / 3;
  if (target == "requests" || target == "web") return 1 + size / 16;
  const bool library = target.starts_with("dicom") || target == "nrrd" || target == "mha" ||
                       target == "nifti" || target == "case_yaml" || target == "named_labels";
  return library ? 1 + size / 48 : 1;
}

TEST(Corpora, AreReadWithoutHarm) {
  const std::filesystem::path corpus = ECORCHE_CORPUS;
  for (const Target& target : targets) {
    std::set<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(corpus / target.name))
      files.insert(entry.path());
    EXPECT_GT(files.size(), 2U) << target.name;
    for (const auto& file : files) {
      SCOPED_TRACE(file.string());
      std::ifstream in(file, std::ios::binary);
      const std::string bytes(std::istreambuf_iterator<char>(in), {});
      run(target, bytes);
      for (std::size_t i = 0; i < bytes.size(); i += step_of(target.name, bytes.size())) {
        run(target, bytes.substr(0, i));
        for (const int turn : {0x01, 0x80, 0xff}) {
          std::string spoilt = bytes;
          spoilt[i] = static_cast<char>(spoilt[i] ^ turn);
          run(target, spoilt);
        }
      }
    }
  }
}

TEST(Corpora, BelongToATarget) {
  for (const auto& entry : std::filesystem::directory_iterator(ECORCHE_CORPUS)) {
    const std::string name = entry.path().filename();
    EXPECT_TRUE(std::any_of(std::begin(targets), std::end(targets), [&](const Target& target) {
      return target.name == name;
    })) << name;
  }
}

// An allocation that no compiler leaves out.
void seen(void* block) {
  asm volatile("" : : "r"(block) : "memory");
}

// What holds the readers to their budgets sees matrices and C libraries too, not only operator new.
TEST(PeakBytes, CountsWhateverIsAllocated) {
  static constexpr std::int64_t mib = 1 << 20;
  EXPECT_LT(peak_bytes([] {}), 4096);
  EXPECT_GE(peak_bytes([] { seen(std::vector<char>(3 * mib).data()); }), 3 * mib);
  EXPECT_GE(peak_bytes([] { seen(Eigen::VectorXd(mib).data()); }), 8 * mib);
  const auto grow_and_free = [] {
    void* block = std::calloc(mib, 1);
    seen(block);
    block = std::realloc(block, 2 * mib);
    seen(block);
    std::free(block);
  };
  EXPECT_GE(peak_bytes(grow_and_free), 2 * mib);
  // Given back: the same again is no more.
  EXPECT_LT(peak_bytes([&] { grow_and_free(), grow_and_free(); }), 4 * mib);
}

}  // namespace
}  // namespace ecorche::fuzz
