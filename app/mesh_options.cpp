// SPDX-License-Identifier: Apache-2.0
#include "app/mesh_options.hpp"

#include <sstream>

#include "app/cli.hpp"
#include "core/values/text.hpp"
#include "preprocess/tet/mesher.hpp"

namespace ecorche::app {
namespace {

// 0, or a value in range: told as one thing.
template <class T>
CLI::Validator or_zero(const preprocess::Options::Range<T>& range, const std::string& unit) {
  std::ostringstream said;
  said << "0, or " << range.low << " to " << range.high;
  return {[said = said.str(), range, unit](std::string& text) -> std::string {
            T value{};
            const bool number = CLI::detail::lexical_cast(text, value);
            if (number && (value == T{} || (value >= range.low && value <= range.high))) return {};
            return "'" + text + "' is not " + said + " " + unit;
          },
          said.str()};
}

}  // namespace

std::vector<CLI::Option*> add_mesh_options(CLI::App& command, preprocess::Options& options) {
  using preprocess::Options;
  std::vector<CLI::Option*> out;
  const auto meshers = tet::mesher_names();
  options.mesher = meshers.front();
  out.push_back(
      command.add_option("--mesher", options.mesher, "who makes the tets: " + text::joined(meshers))
          ->check(CLI::IsMember(owned(meshers)))
          ->capture_default_str());
  out.push_back(
      command
          .add_option(
              "--voxel", options.voxel_mm,
              "voxel edge, mm; 0: the finest whose image stays within 250 x 120 x 700 voxels or their number")
          ->check(or_zero(Options::voxel_range, "mm"))
          ->capture_default_str());
  out.push_back(
      command
          .add_option(
              "--max-tets", options.max_tets,
              "never more tets than this: sizes are coarsened until it holds; 0: two and a half for each "
              "vertex of the case, or a cube of twelve for each 3 x 3 x 3 voxels of the body in its finest "
              "image, from 300000 to 3500000")
          ->check(or_zero(Options::tets_range, "tets"))
          ->capture_default_str());
  out.push_back(command.add_option("--max-nodes", options.max_nodes, "never more nodes than this")
                    ->check(CLI::Range(Options::nodes_range.low, Options::nodes_range.high))
                    ->capture_default_str());
  return out;
}

}  // namespace ecorche::app
