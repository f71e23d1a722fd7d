// SPDX-License-Identifier: Apache-2.0
// The bindings stored in a model against a search through all of its tets and boundary faces, and rest in,
// rest out.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include <ecorche/model_file/model_file.hpp>
#include "tests/support/triangle_distance.hpp"
#include "tests/unit/mapping/exhaustive.hpp"

namespace ecorche {
namespace {

// Tets or faces looked at in all: some seconds. The small phantom is searched whole, larger ones by sample.
constexpr double kBudget = 4e9;

std::vector<std::string> models() {
  const char* listed = std::getenv("ECORCHE_MODELS");
  if (listed == nullptr) listed = std::getenv("ECORCHE_MODEL");
  std::vector<std::string> out;
  std::istringstream words(listed == nullptr ? "" : listed);
  for (std::string path; std::getline(words, path, ':');) out.push_back(path);
  return out;
}

struct Tally {
  std::size_t searched = 0, same = 0, shared = 0, outside = 0, wrong = 0;
  double worst_distance_mm = 0;  // how much farther the stored tet is than the nearest
};

void search(const Model& model, Tally& tally) {
  const auto outer = test::outer_faces(model.tets);
  std::size_t bound = 0;
  for (const Tissue& tissue : model.tissues) bound += tissue.tet.size();
  const auto cost = static_cast<double>(bound) * static_cast<double>(model.tet_count() + 20 * outer.size());
  const auto step = static_cast<std::size_t>(std::max(1.0, cost / kBudget));
  std::size_t vertex = 0;
  for (const Tissue& tissue : model.tissues) {
    for (std::size_t v = 0; v < tissue.tet.size(); ++v) {
      if (vertex++ % step != 0) continue;
      ++tally.searched;
      const Eigen::Vector3d p = tissue.V.row(static_cast<Eigen::Index>(v)).transpose().cast<double>();
      const std::int32_t holder = test::first_holder(model.nodes, model.tets, p);
      if (holder == tissue.tet[v]) {
        ++tally.same;
      } else if (holder >= 0) {
        const bool valid = test::least_coordinate(model.nodes, model.tets, tissue.tet[v], p) >= -1e-8;
        ++(valid ? tally.shared : tally.wrong);
      } else {
        ++tally.outside;
        double least = 1e300, stored = 1e300;
        for (const auto& [face, tet] : outer) {
          const double d =
              test::triangle_distance(p, test::node(model.nodes, face[0]), test::node(model.nodes, face[1]),
                                      test::node(model.nodes, face[2]));
          least = std::min(least, d);
          if (tet == tissue.tet[v]) stored = std::min(stored, d);
        }
        tally.worst_distance_mm = std::max(tally.worst_distance_mm, stored - least);
      }
    }
  }
}

double worst_rest_error(const Model& model) {
  double worst = 0;
  for (const Tissue& tissue : model.tissues) {
    for (std::size_t v = 0; v < tissue.tet.size(); ++v) {
      const auto row = static_cast<Eigen::Index>(v);
      const auto back = test::rebuilt(model.nodes, model.tets, tissue.tet[v], tissue.barycentric.row(row));
      worst = std::max(worst, double{(back - tissue.V.row(row)).norm()});
    }
  }
  return worst;
}

TEST(Mapping, equals_an_exhaustive_search) {
  const auto paths = models();
  ASSERT_FALSE(paths.empty()) << "set ECORCHE_MODELS or ECORCHE_MODEL";
  std::printf("%-28s %9s %9s %9s %7s %9s %7s %12s %12s\n", "model", "tets", "searched", "same tet", "shared",
              "outside", "wrong", "farther mm", "at rest mm");
  for (const std::string& path : paths) {
    const Model model = model_file::read(path, {});
    Tally tally;
    search(model, tally);
    const double rest = worst_rest_error(model);
    std::printf("%-28s %9zu %9zu %9zu %7zu %9zu %7zu %12.3g %12.3g\n",
                path.substr(path.find_last_of('/') + 1).c_str(), model.tet_count(), tally.searched,
                tally.same, tally.shared, tally.outside, tally.wrong, tally.worst_distance_mm, rest);
    EXPECT_GT(tally.searched, 0U);
    EXPECT_EQ(tally.wrong, 0U);
    EXPECT_LT(tally.worst_distance_mm, 1e-6);
    EXPECT_LE(rest, 1e-3);
  }
}

}  // namespace
}  // namespace ecorche
