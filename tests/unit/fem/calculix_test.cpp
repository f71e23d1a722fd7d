// SPDX-License-Identifier: Apache-2.0
// A bent bar against CalculiX (Debian's calculix-ccx): quadratic tets (C3D10), large displacements (NLGEOM),
// and its own neo-Hookean material.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <set>
#include <sstream>

#include "core/files/scratch_folder.hpp"
#include "tests/unit/fem/beams.hpp"
#include "tests/unit/fem/other_materials.hpp"

namespace ecorche::fem {
namespace {

using Eigen::Vector3d;

/// The job of `mesh` whose held nodes go to their rows of `x` in so many steps.
void write_job(const std::filesystem::path& file, const Mesh& mesh, const NeoHooke& material,
               const Points& x) {
  std::ofstream out(file);
  out.precision(17);
  out << "*NODE, NSET=NALL\n";
  for (Eigen::Index n = 0; n < mesh.X.rows(); ++n)
    out << n + 1 << ", " << mesh.X(n, 0) << ", " << mesh.X(n, 1) << ", " << mesh.X(n, 2) << "\n";
  std::set<double> all;
  for (std::size_t t = 0; t < mesh.tets(); ++t) all.insert(mesh.stiffness_of(t));
  const std::vector<double> stiffness(all.begin(), all.end());
  for (std::size_t m = 0; m < stiffness.size(); ++m) {
    out << "*ELEMENT, TYPE=C3D10, ELSET=E" << m << "\n";
    for (std::size_t t = 0; t < mesh.tets(); ++t) {
      if (mesh.stiffness_of(t) != stiffness[m]) continue;
      out << t + 1;
      for (std::size_t a = 0; a < 10; ++a) out << ", " << mesh.corner[10 * t + a] + 1;
      out << "\n";
    }
  }
  for (std::size_t m = 0; m < stiffness.size(); ++m)
    out << "*MATERIAL, NAME=M" << m << "\n*HYPERELASTIC, NEO HOOKE\n"
        << stiffness[m] * material.c10() << ", " << 2 / (stiffness[m] * material.bulk())
        << "\n*SOLID SECTION, ELSET=E" << m << ", MATERIAL=M" << m << "\n";
  out << "*STEP, NLGEOM, INC=1000\n*STATIC\n0.1, 1.\n*CONTROLS, PARAMETERS=FIELD\n1e-9, 1e-9\n*BOUNDARY\n";
  for (std::size_t n = 0; n < mesh.free.size(); ++n) {
    if (mesh.free[n] >= 0) continue;
    const auto row = static_cast<Eigen::Index>(n);
    for (Eigen::Index c = 0; c < 3; ++c)
      out << n + 1 << ", " << c + 1 << ", " << c + 1 << ", " << x(row, c) - mesh.X(row, c) << "\n";
  }
  out << "*NODE FILE\nU\n*END STEP\n";
}

/// The displacements of the last increment in a .frd file: lines ` -1`, the node in 10 columns, then 12 each.
Points read_frd(const std::filesystem::path& file, Eigen::Index nodes) {
  std::ifstream in(file);
  Points out = Points::Constant(nodes, 3, std::nan(""));
  bool of_displacement = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with(" -4")) of_displacement = line.find("DISP") != std::string::npos;
    if (line.starts_with(" -3")) of_displacement = false;
    if (!of_displacement || !line.starts_with(" -1")) continue;
    const auto node = static_cast<Eigen::Index>(std::stoll(line.substr(3, 10))) - 1;
    for (Eigen::Index c = 0; c < 3; ++c)
      out(node, c) = std::stod(line.substr(static_cast<std::size_t>(13 + 12 * c), 12));
  }
  return out;
}

/// A bar, bent. `ratio`: by how much the half beyond y = 20 is stiffer than the other.
void expect_the_same_bar(double ratio) {
  ASSERT_EQ(std::system("command -v ccx > /dev/null"), 0) << "ccx is not installed (scripts/setup --all)";
  const double L = 160, a = 40;
  const auto held = [&](const Vector3d& X) { return X.z() < 30.1 || X.z() > L - 30.1; };
  const NeoHooke material(lame(0.45));
  for (const double degrees : {30.0, 60.0}) {
    const auto bent = [&](const Vector3d& X, double t) -> Vector3d {
      if (X.z() < L / 2) return X;
      const Vector3d about(a / 2, a / 2, L / 2);
      return Eigen::AngleAxisd(t * degrees * std::numbers::pi / 180, Vector3d::UnitX()) * (X - about) + about;
    };
    Mesh bar = mesh_of(Element::p2, test::box_mesh({2, 2, 8}, 20), held);
    for (std::size_t t = 0; t < bar.tets() && ratio != 1; ++t) {
      double y = 0;
      for (std::size_t c = 0; c < 4; ++c) y += bar.X(bar.corner[10 * t + c], 1) / 4;
      bar.stiffness.push_back(y < a / 2 ? 1 : ratio);
    }
    const Solved ours = solve(std::move(bar), material, bent, 0.25, 1e-8);
    ASSERT_TRUE(ours.follow.newton.converged);
    const files::ScratchFolder folder(std::filesystem::temp_directory_path() / "ecorche_calculix");
    write_job(folder.path() / "bar.inp", ours.mesh, material, ours.x);
    const std::string command =
        "cd '" + folder.path().string() + "' && OMP_NUM_THREADS=1 ccx -i bar > bar.log 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0);
    const Points theirs = read_frd(folder.path() / "bar.frd", ours.x.rows());
    double worst = 0;
    for (std::size_t n = 0; n < ours.mesh.free.size(); ++n) {
      const auto row = static_cast<Eigen::Index>(n);
      if (ours.mesh.free[n] >= 0)
        worst = std::max(worst, (ours.x.row(row) - ours.mesh.X.row(row) - theirs.row(row)).norm());
    }
    ::testing::Test::RecordProperty("worst_mm_at_" + std::to_string(static_cast<int>(degrees)),
                                    std::to_string(worst));
    EXPECT_LT(worst, 1e-3) << degrees << " degrees";
  }
}

TEST(CalculiX, ABentBarOfQuadraticTets) {
  expect_the_same_bar(1);
}

TEST(CalculiX, ABentBarOfTwoStiffnesses) {
  expect_the_same_bar(5);
}

}  // namespace
}  // namespace ecorche::fem
