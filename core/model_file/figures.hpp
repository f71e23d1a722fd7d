// SPDX-License-Identifier: Apache-2.0
// The figures of a certificate by name: stored, compared and printed under the same words.
#pragma once

#include <string_view>

#include <ecorche/values/model.hpp>

namespace ecorche::model_file {

/// Calls `f(name, figure)` for every member of a certificate (const or not), in the order of its declaration.
template <class C, class F>
void for_each_figure(C& certificate, F&& f) {
  f(std::string_view("solver_residual"), certificate.solver_residual);
  f(std::string_view("first_violation"), certificate.first_violation);
  f(std::string_view("mended_nodes"), certificate.mended_nodes);
  f(std::string_view("mended_largest_change"), certificate.mended_largest_change);
  f(std::string_view("solved_min_weight"), certificate.solved_min_weight);
  f(std::string_view("solved_max_weight"), certificate.solved_max_weight);
  f(std::string_view("solved_row_sum_error"), certificate.solved_row_sum_error);
  f(std::string_view("repaired_rows"), certificate.repaired_rows);
  f(std::string_view("repaired_largest_change"), certificate.repaired_largest_change);
  f(std::string_view("min_weight"), certificate.min_weight);
  f(std::string_view("max_weight"), certificate.max_weight);
  f(std::string_view("row_sum_error"), certificate.row_sum_error);
  f(std::string_view("min_dihedral_deg"), certificate.min_dihedral_deg);
  f(std::string_view("max_dihedral_deg"), certificate.max_dihedral_deg);
  f(std::string_view("inverted_tets"), certificate.inverted_tets);
  f(std::string_view("degenerate_tets"), certificate.degenerate_tets);
  f(std::string_view("min_edge_mm"), certificate.min_edge_mm);
  f(std::string_view("positive_offdiagonal_share"), certificate.positive_offdiagonal_share);
  f(std::string_view("tissue_vertices"), certificate.tissue_vertices);
  f(std::string_view("outside_vertices"), certificate.outside_vertices);
  f(std::string_view("max_outside_mm"), certificate.max_outside_mm);
  f(std::string_view("bone_tets"), certificate.bone_tets);
  f(std::string_view("contested_tets"), certificate.contested_tets);
  f(std::string_view("contested_share"), certificate.contested_share);
  f(std::string_view("least_bone_share"), certificate.least_bone_share);
  f(std::string_view("bone_tet_change"), certificate.bone_tet_change);
  f(std::string_view("bone_rigidity_mm"), certificate.bone_rigidity_mm);
}

}  // namespace ecorche::model_file
