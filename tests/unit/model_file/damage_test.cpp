// SPDX-License-Identifier: Apache-2.0
// Whatever happens to a file's bytes: reading it either throws an Error or gives the very same model.
#include <fstream>
#include <random>

#include "tests/support/toy_model.hpp"
#include "tests/unit/model_file/test_files.hpp"

namespace ecorche::test {
namespace {

class Damage : public ModelFileTest {
 protected:
  Damage() : model_(toy_model()) {
    model_file::write(model_, file("a.hdf"), {});
    bytes_ = load(file("a.hdf"));
    identity_ = model_file::identity(model_);
  }
  // True when it was refused.
  bool refused_or_same(const Bytes& bytes, const std::string& what) {
    store(file("b.hdf"), bytes);
    try {
      const Model read = model_file::read(file("b.hdf"), {});
      EXPECT_EQ(model_file::identity(read), identity_) << what;
      EXPECT_EQ(read.provenance, model_.provenance) << what;
      return false;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::data) << what << ": " << error.what();
      return true;
    }
  }

  Model model_;
  Bytes bytes_;
  std::uint64_t identity_ = 0;
};

TEST_F(Damage, EveryTruncationIsRefused) {
  std::mt19937_64 random(7);
  std::vector<std::size_t> lengths{
      0, 1, 7, 8, 9, 47, 48, 511, 512, 513, bytes_.size() - 1, bytes_.size() / 2};
  for (int i = 0; i < 200; ++i) lengths.push_back(random() % bytes_.size());
  for (const std::size_t length : lengths) {
    EXPECT_TRUE(refused_or_same(Bytes(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(length)),
                                "first " + std::to_string(length) + " bytes"))
        << length;
  }
}

TEST_F(Damage, FlippedBitsAreRefusedOrHarmless) {
  std::mt19937_64 random(11);
  int refused = 0;
  for (int i = 0; i < 600; ++i) {
    Bytes bytes = bytes_;
    const std::size_t at = random() % bytes.size();
    const int bit = static_cast<int>(random() % 8);
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << bit));
    refused +=
        refused_or_same(bytes, "bit " + std::to_string(bit) + " of byte " + std::to_string(at)) ? 1 : 0;
  }
  std::printf("600 single flips: %d refused, the others changed nothing\n", refused);
  EXPECT_GT(refused, 300);
}

TEST_F(Damage, RandomBytesInTheHeadersAreRefused) {
  std::mt19937_64 random(13);
  for (int i = 0; i < 300; ++i) {
    Bytes bytes = bytes_;
    const std::size_t from = random() % bytes.size(), length = 1 + random() % 64;
    for (std::size_t at = from; at < std::min(bytes.size(), from + length); ++at) {
      bytes[at] = static_cast<char>(random());
    }
    refused_or_same(bytes, "noise at " + std::to_string(from));
  }
}

TEST_F(Damage, NoiseIsRefused) {
  std::mt19937_64 random(17);
  for (int i = 0; i < 20; ++i) {
    Bytes bytes(1 << (i % 14));
    for (char& byte : bytes) byte = static_cast<char>(random());
    if (i % 2 == 1) std::copy_n(bytes_.begin(), std::min<std::size_t>(bytes.size(), 48), bytes.begin());
    EXPECT_TRUE(refused_or_same(bytes, "noise " + std::to_string(i)));
  }
}

TEST_F(Damage, DigestsNameTheDamagedDataset) {
  const auto at = static_cast<std::size_t>(
      std::search(bytes_.begin(), bytes_.end(), reinterpret_cast<const char*>(model_.weights.weight.data()),
                  reinterpret_cast<const char*>(model_.weights.weight.data() + 64)) -
      bytes_.begin());
  ASSERT_LT(at, bytes_.size());
  bytes_[at] = static_cast<char>(bytes_[at] ^ 1);
  store(file("b.hdf"), bytes_);
  const Error error = error_of([&] { model_file::read(file("b.hdf"), {}); });
  EXPECT_NE(error.where().find("/ecorche/weights/weight"), std::string::npos) << error.what();
  EXPECT_EQ(error.problem(), "is damaged: its XXH64 is not the stored one");
  int bad = 0;
  for (const auto& check : model_file::check_digests(file("b.hdf"), {})) {
    bad += check.good ? 0 : 1;
    EXPECT_EQ(check.good, check.dataset != "/ecorche/weights/weight");
  }
  EXPECT_EQ(bad, 1);
}

TEST_F(Damage, WhatIsNoFileIsMissing) {
  EXPECT_EQ(error_of([&] { model_file::read(file("none.hdf"), {}); }).kind(), ErrorKind::missing_input);
  EXPECT_EQ(error_of([&] { model_file::read(folder(), {}); }).kind(), ErrorKind::missing_input);
  EXPECT_EQ(error_of([&] { model_file::read("/dev/zero", {}); }).kind(), ErrorKind::missing_input);
}

}  // namespace
}  // namespace ecorche::test
