// SPDX-License-Identifier: Apache-2.0
#include "app/report/html.hpp"

#include <nlohmann/json.hpp>

namespace ecorche::app::report {

std::string escaped(std::string_view text) {
  // The JSON library knows what UTF-8 is; of what it writes only the quotes and its own escapes are undone.
  using Json = nlohmann::json;
  const auto valid = Json::parse(Json(std::string(text)).dump(-1, ' ', false, Json::error_handler_t::replace))
                         .get<std::string>();
  std::string out;
  for (const char c : valid) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
    }
  }
  return out;
}

}  // namespace ecorche::app::report
