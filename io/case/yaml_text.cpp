// SPDX-License-Identifier: Apache-2.0
#include "io/case/yaml_text.hpp"

#include <charconv>
#include <numbers>

#include "core/values/identifier.hpp"
#include "io/case/yaml_reader.hpp"

namespace ecorche::io::yaml {

std::string write_number(double value) {
  char text[40];
  const char* end = std::to_chars(text, text + sizeof text, value).ptr;
  return std::string(static_cast<const char*>(text), end);
}

std::string write_degrees(double radians) {
  constexpr long double degree = std::numbers::pi_v<long double> / 180;
  const long double degrees = radians / degree;
  // A degree in double is too coarse for some radians: extended digits where plain ones do not do.
  const auto exact = [&](std::chars_format format, int digits) -> std::string {
    char text[96];
    const char* end = std::to_chars(text, text + sizeof text, degrees, format, digits).ptr;
    long double back = 0;
    std::from_chars(text, end, back);
    return static_cast<double>(back * degree) == radians ? std::string(static_cast<const char*>(text), end)
                                                         : "";
  };
  for (int digits = 0; digits <= 17; ++digits) {
    if (std::string text = exact(std::chars_format::fixed, digits); !text.empty()) return text;
  }
  for (int digits = 17; digits <= 21; ++digits) {
    if (std::string text = exact(std::chars_format::general, digits); !text.empty()) return text;
  }
  return write_number(static_cast<double>(degrees));
}

std::string write_vector(const Eigen::Vector3d& v) {
  return "[" + write_number(v.x()) + ", " + write_number(v.y()) + ", " + write_number(v.z()) + "]";
}

std::string write_text(std::string_view text) {
  // Letters first: a word of digits would read as a number to others, `null` as nothing.
  const bool plain = is_identifier(text) && text.front() >= 'a' && text != "null" && text != "true" &&
                     text != "false" && text != "yes" && text != "no" && text != "on" && text != "off";
  if (plain) return std::string(text);
  constexpr std::string_view hex = "0123456789abcdef";
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (byte < 0x20 || byte == 0x7f) {
      out += "\\x";
      out += hex[byte >> 4];
      out += hex[byte & 15];
    } else {
      out += c;
    }
  }
  return out + "\"";
}

}  // namespace ecorche::io::yaml
