// SPDX-License-Identifier: Apache-2.0
// The kept corpora, whole, cut at every length and with bytes turned, through every target.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "tests/fuzz/targets.hpp"

namespace ecorche::fuzz {
namespace {

void run(const Target& target, const std::string& bytes) {
  target.run(std::as_bytes(std::span(bytes)));
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
      // A model is a file written and read: fewer of them.
      const std::size_t step = std::string(target.name) == "model" ? 1 + bytes.size() / 3 : 1;
      for (std::size_t i = 0; i < bytes.size(); i += step) {
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

}  // namespace
}  // namespace ecorche::fuzz
