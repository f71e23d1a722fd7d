// SPDX-License-Identifier: AGPL-3.0-or-later
#include "app/command_line.hpp"

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <ecorche/values/error.hpp>
#include "app/cli.hpp"
#include "app/nan_value.hpp"
#include "core/values/text.hpp"
#include "io/case/yaml_reader.hpp"

namespace ecorche::app {
namespace {

// In the order in which they run: each reads what those before have written.
const std::vector<std::pair<std::string, std::string>> kExamples{
    {"phantom", "ecorche phantom -o patient --size small"},
    {"check", "ecorche check patient"},
    {"repair", "ecorche repair patient -o mended"},
    {"rig", "ecorche rig patient -o rest.yaml"},
    {"preprocess", "ecorche preprocess patient -o patient.hdf --max-tets 100000 --spheres 0.6"},
    {"info", "ecorche info patient.hdf"},
    {"verify", "ecorche verify patient.hdf"},
    {"pose", "ecorche pose patient.hdf -o sitting --pose lib:sitting"},
    {"unpose", "ecorche unpose sitting -o back"},
    {"motion", "ecorche motion patient/motion/walk.bvh --model patient.hdf"},
    {"export", "ecorche export patient.hdf -o patient.glb"},
    {"thin", "ecorche thin patient/volumes/labels.nrrd -o body.vtp --isotropic 0 --tree"},
    {"refill", "ecorche refill body.vtp -o body.nrrd"},
    {"path", "ecorche path body.vtp --from -88,0,300 --to 0,0,900 -o way.csv"},
    {"deformers", "ecorche deformers patient.hdf --volume labels --pose lib:sitting -o compared"},
    {"tears", "ecorche tears patient.hdf --motion patient/motion/walk.bvh --frames 0:30:10"},
    {"radiograph",
     "ecorche radiograph patient.hdf -o knee.png --view lateral_left --target knee_left --size 300,300"},
    {"calibrate", "ecorche calibrate patient.hdf -o calibrated.hdf --joints elbow_right --step 30"},
    {"fem", "ecorche fem patient.hdf -o anatomical --pose lib:anatomical --tissues skin"},
    {"contact", "ecorche contact patient.hdf patient.hdf --other-pose lib:sitting"},
};

// Examples that need what a test cannot know beforehand.
const std::vector<std::pair<std::string, std::string>> kMoreExamples{
    {"new", "ecorche new ct.nii.gz segmentations -o my_patient --report my_patient.html"},
    {"probe", "ecorche probe patient.hdf --points points.csv --pose lib:sitting"},
    {"serve", "ecorche serve patient.hdf --http 127.0.0.1:8080"},
    {"cohort", "ecorche cohort bids results participant group --participant-label 01 02"},
    {"report", "ecorche report group results"},
    {"igtl", "ecorche igtl patient.hdf --goal Stylus=hand_right"},
    {"stream", "ecorche stream 127.0.0.1:7070 --motion patient/motion/walk.bvh"},
};

class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    if (option->get_items_expected_max() == 0) return {};
    std::string out = " " + type(*option);
    if (!option->get_default_str().empty()) out += "=" + option->get_default_str();
    if (option->get_required() && option->nonpositional()) out += " (required)";
    return out;
  }

 private:
  // `TEXT:{a,b,c}` of a choice becomes `a|b|c`.
  static std::string type(const CLI::Option& option) {
    std::string name = option.get_type_name();
    const std::size_t open = name.find(":{");
    if (open == name.npos || name.back() != '}') return name;
    name = name.substr(open + 2, name.size() - open - 3);
    for (char& c : name)
      if (c == ',') c = '|';
    return name;
  }
};

std::vector<std::string> names_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

// The first word that is no option, nor the value of one of the program's own: the subcommand.
std::string_view first_word(const CLI::App& app, int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word.empty() || word[0] != '-') return word;
    const CLI::Option* option = app.get_option_no_throw(std::string(word));
    if (option != nullptr && option->get_items_expected_max() > 0) ++i;
  }
  return {};
}

// Options of the program and of the subcommand, as they are written.
std::vector<std::string> options_of(const CLI::App& app, const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* of : {&app, &command}) {
    for (const CLI::Option* option : of->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  }
  return names;
}

Error misuse(const CLI::App& app, std::string_view word, const CLI::ParseError& error) {
  const std::string command = "ecorche " + std::string(word);
  std::string mend = "see " + command + " --help";
  // CLI11 names what it did not expect last.
  const std::string what = error.what();
  if (const auto* extras = dynamic_cast<const CLI::ExtrasError*>(&error); extras != nullptr) {
    const std::string extra = what.substr(what.rfind(' ') + 1);
    const std::string near =
        io::yaml::nearest(extra, options_of(app, *app.get_subcommand(std::string(word))));
    if (!near.empty()) mend = "did you mean " + near + "? " + mend;
  }
  return {ErrorKind::usage, command, what, mend};
}

void refuse_nan(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    const std::string* value = nan_value(*option);
    if (value == nullptr) continue;
    const std::string name = "ecorche " + command.get_name();
    throw Error(ErrorKind::usage, name, option->get_name() + ": '" + *value + "' is no number",
                "see " + name + " --help");
  }
}

}  // namespace

void dress_help(CLI::App& app) {
  const auto formatter = std::make_shared<HelpFormatter>();
  formatter->column_width(34);
  app.formatter(formatter);
  app.footer("ecorche SUBCOMMAND --help tells more, with an example.");
  for (const auto* examples : {&kExamples, &kMoreExamples}) {
    for (const auto& [name, line] : *examples) {
      CLI::App* command = app.get_subcommand(name);
      command->formatter(formatter);
      std::string footer = command->get_footer();
      if (!footer.empty()) footer += "\n\n";
      footer.append("Example: ").append(line).append("\nAlso: --json, --threads N (ecorche --help).");
      command->footer(footer);
    }
  }
}

void parse(CLI::App& app, int argc, char** argv) {
  const std::string_view word = first_word(app, argc, argv);
  const std::vector<std::string> known = names_of(app);
  if (!word.empty() && std::find(known.begin(), known.end(), word) == known.end()) {
    const std::string near = io::yaml::nearest(word, known);
    throw Error(ErrorKind::usage, "ecorche", "unknown subcommand '" + std::string(word) + "'",
                near.empty() ? "one of " + text::joined(known) : "did you mean '" + near + "'?");
  }
  try {
    app.parse(argc, argv);
    for (const CLI::App* command : app.get_subcommands()) refuse_nan(*command);
  } catch (const CLI::Success&) {
    throw;
  } catch (const CLI::ParseError& error) {
    if (word.empty())
      throw Error(ErrorKind::usage, "ecorche", "no subcommand", "one of " + text::joined(known));
    throw misuse(app, word, error);
  }
}

}  // namespace ecorche::app
