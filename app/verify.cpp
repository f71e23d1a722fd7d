// SPDX-License-Identifier: Apache-2.0
// ecorche verify MODEL: digests, invariants and the certificate, all measured again.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/preprocess/pipeline.hpp>
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/contacts_report.hpp"
#include "app/model_report.hpp"
#include "core/model_file/figures.hpp"
#include "preprocess/bounds.hpp"

namespace ecorche::app {
namespace {

// What instruction sets may round differently: sums in doubles, and lengths that went through float32
// positions. Anything beyond is another model.
constexpr double kRelative = 1e-6, kAbsolute = 1e-9, kLength = 1e-3;

struct Verdict {
  std::vector<std::string> faults;  // empty: the model is good
  std::size_t checked = 0, bad = 0;
  Model model;  // read only when its digests are good
  bool read = false;
  Certificate found;
  nlohmann::json contacts = nlohmann::json::array();  // limbs that touch what they do not hang on
};

void check_digests(const std::string& path, const Program& program, Verdict& verdict) {
  for (const model_file::DigestCheck& check : model_file::check_digests(path, program.context("digests"))) {
    ++verdict.checked;
    if (check.good) continue;
    ++verdict.bad;
    verdict.faults.push_back(path + ":" + check.dataset + ": XXH64 is not the stored one");
  }
}

// A stored figure that measuring does not find again.
void compare(const Certificate& stored, const Certificate& found, double length_mm,
             std::vector<std::string>& faults) {
  std::vector<double> measured;
  model_file::for_each_figure(found,
                              [&](auto, auto value) { measured.push_back(static_cast<double>(value)); });
  std::size_t i = 0;
  model_file::for_each_figure(stored, [&](std::string_view name, auto value) {
    const double was = static_cast<double>(value), is = measured[i++];
    const double absolute = name.ends_with("_mm") ? length_mm : kAbsolute;
    if (was == is || std::abs(was - is) <= absolute + kRelative * std::abs(was)) return;
    faults.push_back(std::string(name) + ": the certificate says " + nlohmann::json(was).dump() +
                     ", measured " + nlohmann::json(is).dump());
  });
}

Verdict verify(const std::string& path, const Program& program) {
  Verdict verdict;
  check_digests(path, program, verdict);
  if (verdict.bad > 0) return verdict;
  try {
    verdict.model = model_file::read(path, program.context("invariants"));
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::data) throw;
    verdict.faults.emplace_back(error.what());
    return verdict;
  }
  verdict.read = true;
  verdict.found = preprocess::measure(verdict.model, program.context("certificate"));
  verdict.contacts = contacts_json(verdict.model);
  const preprocess::BodySize size = preprocess::body_size(verdict.model);
  for (const std::string& broken : preprocess::broken_bounds(verdict.found, size))
    verdict.faults.push_back(broken);
  compare(verdict.model.certificate, verdict.found, std::max(kLength, size.posed_grain_mm), verdict.faults);
  return verdict;
}

std::string verify_text(const Verdict& v) {
  std::string text = std::to_string(v.checked) + " datasets, " + std::to_string(v.bad) + " damaged\n";
  if (v.read) {
    text += std::to_string(v.model.node_count()) + " nodes, " + std::to_string(v.model.tet_count()) +
            " tets, " + std::to_string(v.model.segment_count()) + " segments, " +
            std::to_string(v.model.tissues.size()) + " tissues\n";
    model_file::for_each_figure(v.found, [&](std::string_view name, auto value) {
      text += "  " + std::string(name) + ": " + nlohmann::json(value).dump() + "\n";
    });
  }
  text += contacts_text(v.contacts);
  const char* good = v.contacts.empty() ? "the model is good" : "the model is good, but for limbs that touch";
  return text + (v.faults.empty() ? good : "the model is NOT good") +
         "; for training and education, not for planning surgery";
}

}  // namespace

void declare_verify(CLI::App& app, Program& program, Run& chosen) {
  auto* command =
      app.add_subcommand("verify", "measure digests, invariants and the certificate of a model again");
  auto path = std::make_shared<std::string>();
  command->add_option("model", *path, "the model, a .hdf file")->required();
  command->callback([path, &program, &chosen] {
    chosen = [path, &program] {
      const Verdict verdict = verify(*path, program);
      for (const std::string& fault : verdict.faults) program.note("fault: " + fault);
      if (!verdict.contacts.empty()) program.warn();
      nlohmann::json report = model_report(verdict.faults.empty(), verdict.read ? &verdict.model : nullptr,
                                           verdict.found, verdict.checked, verdict.bad);
      report["contacts"] = verdict.contacts;
      program.result(verify_text(verdict), report);
      return verdict.faults.empty() ? 0 : exit_code(ErrorKind::data);
    };
  });
}

}  // namespace ecorche::app
