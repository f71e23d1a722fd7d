// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include <ecorche/values/error.hpp>
#include "core/values/identifier.hpp"
#include "core/values/text.hpp"
#include "core/values/utf8.hpp"

namespace ecorche {
namespace {

using Words = std::vector<std::string_view>;

TEST(Text, SpacesAreThoseOfAscii) {
  for (int c = 0; c < 256; ++c) {
    const bool space = std::string_view(" \t\n\v\f\r").find(static_cast<char>(c)) != std::string_view::npos;
    EXPECT_EQ(text::is_space(static_cast<char>(c)), space) << c;
  }
  EXPECT_EQ(text::trim(" \t\r\n\v\fone two\r\n"), "one two");
  EXPECT_EQ(text::trim("one"), "one");
  EXPECT_EQ(text::trim(" \n "), "");
  EXPECT_EQ(text::trim(""), "");
}

TEST(Text, LettersBeyondAsciiStay) {
  EXPECT_EQ(text::lower("Abc [XYZ] @`{ \xC3\x84"), "abc [xyz] @`{ \xC3\x84");
}

TEST(Text, WordsStandBetweenSpaces) {
  EXPECT_EQ(text::words("  one\ttwo \r\n three"), (Words{"one", "two", "three"}));
  EXPECT_EQ(text::words(" \n"), Words());
  std::string_view rest = " one  two";
  EXPECT_EQ(text::cut_word(rest), "one");
  EXPECT_EQ(rest, "  two");
  EXPECT_EQ(text::cut_word(rest), "two");
  EXPECT_EQ(text::cut_word(rest), "");
}

TEST(Text, ListsAreJoined) {
  EXPECT_EQ(text::joined(Words{}), "");
  EXPECT_EQ(text::joined(Words{"", "b"}), ", b");
  EXPECT_EQ(text::joined(std::vector<std::string>{"a", "b"}, " or "), "a or b");
}

TEST(Text, NumbersAreThoseOfPrintf) {
  for (const double x : {0.0, -0.0, 1.0, 999.5, 1234567.0, -0.00001234, 1e300, std::nan(""),
                         std::numeric_limits<double>::infinity()}) {
    for (const int digits : {3, 6, 9}) {
      char printed[64];
      std::snprintf(printed, sizeof printed, "%.*g", digits, x);
      EXPECT_EQ(text::number(x, digits), printed);
    }
    if (std::isfinite(x)) {
      EXPECT_EQ(std::stod(text::shortest(x)), x);
    }
  }
  EXPECT_EQ(text::shortest(0.1), "0.1");
  EXPECT_EQ(text::shortest(-std::numeric_limits<double>::max()), "-1.7976931348623157e+308");
}

TEST(Text, HexHasAllDigits) {
  EXPECT_EQ(text::hex(0), "0000000000000000");
  EXPECT_EQ(text::hex(0xFEDC'BA98'7654'3210), "fedcba9876543210");
}

// Of RFC 3629: no longer than need be, no half of a pair, nothing beyond U+10FFFF, nothing cut.
TEST(Text, KnowsWhatIsACharacter) {
  using Character = std::pair<std::uint32_t, std::size_t>;
  EXPECT_EQ(text::first_character("a\xC3"), Character('a', 1));
  EXPECT_EQ(text::first_character("\xC3\xA9!"), Character(0xE9, 2));
  EXPECT_EQ(text::first_character("\xE0\xA0\x80"), Character(0x800, 3));
  EXPECT_EQ(text::first_character("\xF0\x90\x80\x80"), Character(0x10000, 4));
  EXPECT_EQ(text::first_character("\xF4\x8F\xBF\xBF"), Character(0x10FFFF, 4));
  for (const char* const bad : {"\x80", "\xC1\xBF", "\xE0\x9F\xBF", "\xED\xA0\x80", "\xF0\x8F\xBF\xBF",
                                "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xC3", "\xE2\x82", "\xC3(", "\xFF"})
    EXPECT_EQ(text::first_character(bad), Character(0, 0)) << bad;
}

// What a damaged file names goes into JSON, onto terminals and on the wire.
TEST(Text, ErrorsAreOneLineOfText) {
  const Error error(ErrorKind::data, "a\nb\xC3\xA9", "\x1b[2J\xA3\xFF",
                    "\xC2\x9B"
                    "31m");
  EXPECT_STREQ(error.what(), "a b\xC3\xA9:  [2J?? ( 31m)");
  EXPECT_EQ(to_status(error).message, error.what());
}

TEST(Identifier, HasOneTo64Characters) {
  for (const char* const good : {"a", "thigh_right", "0", "_", "c7_t1"})
    EXPECT_TRUE(is_identifier(good)) << good;
  for (const char* const bad : {"", "Thigh", "thigh right", "thigh-right", "a/b", "\xC3\xA9", "a\n"})
    EXPECT_FALSE(is_identifier(bad)) << bad;
  EXPECT_TRUE(is_identifier(std::string(64, 'a')));
  EXPECT_FALSE(is_identifier(std::string(65, 'a')));
  EXPECT_FALSE(is_identifier(std::string_view("a\0b", 3)));
}

TEST(Identifier, IsMadeFromWhatPeopleWrite) {
  EXPECT_EQ(identifier_from("  Left Femur (distal)"), "left_femur_distal");
  EXPECT_EQ(identifier_from("vertebrae_S1"), "vertebrae_s1");
  EXPECT_EQ(identifier_from("\xC3\xA9\xC3\xA9"), "");
  EXPECT_EQ(identifier_from(std::string(80, 'a')), std::string(64, 'a'));
  EXPECT_EQ(identifier_from("abc def", 4), "abc");  // no '_' at the end, where it is cut either
}

}  // namespace
}  // namespace ecorche
