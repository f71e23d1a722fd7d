// SPDX-License-Identifier: Apache-2.0
#include "app/certificate_report.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "preprocess/bounds.hpp"

namespace ecorche::app {

nlohmann::json certificate_json(const Certificate& certificate, const preprocess::BodySize& size) {
  nlohmann::json out = nlohmann::json::array();
  for (const preprocess::JudgedFigure& figure : preprocess::judge(certificate, size)) {
    nlohmann::json row{{"figure", figure.figure}, {"value", figure.value}, {"kept", figure.kept}};
    row["bound"] = figure.bound != nullptr ? nlohmann::json(preprocess::describe(*figure.bound)) : nullptr;
    row["least"] = figure.least ? nlohmann::json(*figure.least) : nullptr;
    row["most"] = figure.most ? nlohmann::json(*figure.most) : nullptr;
    row["reason"] = figure.bound != nullptr ? nlohmann::json(figure.bound->reason) : nullptr;
    out.push_back(std::move(row));
  }
  return out;
}

std::string certificate_text(const Certificate& certificate, const preprocess::BodySize& size) {
  std::string out =
      "figure                           value  bound                                   because\n";
  for (const preprocess::JudgedFigure& figure : preprocess::judge(certificate, size)) {
    char line[128];
    const std::string bound = figure.bound != nullptr ? preprocess::describe(*figure.bound) : "";
    std::snprintf(line, sizeof line, "%-26s %11.6g  %-38s", std::string(figure.figure).c_str(), figure.value,
                  bound.c_str());
    out += line;
    if (!figure.kept) out += "  BROKEN:";
    if (figure.bound != nullptr) out += "  " + std::string(figure.bound->reason);
    while (out.back() == ' ') out.pop_back();
    out += '\n';
  }
  return out;
}

}  // namespace ecorche::app
