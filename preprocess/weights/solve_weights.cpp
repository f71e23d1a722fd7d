// SPDX-License-Identifier: Apache-2.0
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "preprocess/weights/conductivity.hpp"
#include "preprocess/weights/harmonic.hpp"
#include "preprocess/weights/monotone.hpp"
#include "preprocess/weights/parts.hpp"
#include "preprocess/weights/repair.hpp"

namespace ecorche::weights {
namespace {

constexpr double kStored =
    1e-6;  ///< smallest weight that is kept: the centres of rotation need them this small
constexpr double kLargestChange = 1e-2;  ///< of a repair

/// Segments that own at least one fixed node, ascending: the columns of the block.
std::vector<std::int32_t> live_segments(const std::vector<std::int32_t>& owner, std::size_t segments) {
  std::vector<std::uint8_t> live(segments, 0);
  for (const std::int32_t s : owner) {
    if (s >= 0) live.at(static_cast<std::size_t>(s)) = 1;
  }
  std::vector<std::int32_t> columns;
  for (std::size_t s = 0; s < segments; ++s) {
    if (live[s]) columns.push_back(static_cast<std::int32_t>(s));
  }
  return columns;
}

void warn_of_untouched_bones(const TetMesh& mesh, const Case& patient, const Context& context) {
  std::vector<std::uint8_t> seen(patient.bones.size() + 1, 0);
  for (const std::uint16_t label : mesh.label) seen[label] = 1;
  for (std::size_t b = 0; b < patient.bones.size(); ++b) {
    if (!seen[b + 1])
      context.warn("bone '" + patient.bones[b].name +
                   "' has no tet: nothing follows it through the mesh "
                   "(more tets by --max-tets, or a smaller --voxel)");
  }
}

void warn_of_mended_nodes(const MonotoneResult& solved, const Context& context) {
  if (solved.mended_nodes == 0) return;
  std::array<char, 280> line{};
  std::snprintf(line.data(), line.size(),
                "weights left [0, 1] by up to %.2g beside bad tets: solved again with the ties of %lld nodes "
                "mended, by which a weight moved by up to %.2g (--mesher lattice makes no bad tets)",
                solved.first_violation, static_cast<long long>(solved.mended_nodes), solved.largest_change);
  context.warn(line.data());
}

/// Of both equations where there are two: the worse.
void certify_mending(const MonotoneResult& solved, Certificate& certificate) {
  certificate.first_violation = std::max(certificate.first_violation, solved.first_violation);
  certificate.mended_nodes =
      std::max(certificate.mended_nodes, static_cast<std::uint64_t>(solved.mended_nodes));
  certificate.mended_largest_change = std::max(certificate.mended_largest_change, solved.largest_change);
}

/// Names a node whose weights cannot be had, and the tets around it.
[[noreturn]] void refuse(const TetMesh& mesh, std::int32_t node, double violation, std::int64_t like_it) {
  std::string tets;
  int named = 0;
  for (Eigen::Index t = 0; t < mesh.T.rows() && named < 8; ++t) {
    if ((mesh.T.row(t).array() != node).all()) continue;
    tets += (named++ == 0 ? "" : ", ") + std::to_string(t);
  }
  const auto p = mesh.V.row(node);
  std::array<char, 400> what{};
  std::snprintf(what.data(), what.size(),
                "the weights of node %d at (%.2f, %.2f, %.2f) leave [0, 1] by %.2g, and %lld of %lld nodes "
                "need mending; "
                "its tets: %s",
                node, p(0), p(1), p(2), violation, static_cast<long long>(like_it),
                static_cast<long long>(mesh.V.rows()), tets.c_str());
  throw Error(ErrorKind::data, "weights", what.data(),
              "the mesh is full of slivers: use another mesher, or more tets by --max-tets or --voxel");
}

using Range = tbb::blocked_range<std::size_t>;
constexpr std::size_t kPiece = 4096;  // rows

/// Largest, smallest and row sums over the rows that were solved.
void measure_solved(const solve::Block& values, const std::vector<std::int32_t>& source,
                    Certificate& certificate) {
  struct Seen {
    double low = 1, high = 0, error = 0;
  };
  const auto join = [](const Seen& a, const Seen& b) {
    return Seen{std::min(a.low, b.low), std::max(a.high, b.high), std::max(a.error, b.error)};
  };
  const Seen seen = tbb::parallel_reduce(
      Range(0, source.size(), kPiece), Seen{},
      [&](const Range& range, Seen out) {
        for (std::size_t n = range.begin(); n < range.end(); ++n) {
          if (source[n] >= 0) continue;
          const auto row = values.row(static_cast<Eigen::Index>(n));
          out = join(out, {row.minCoeff(), row.maxCoeff(), std::abs(row.sum() - 1)});
        }
        return out;
      },
      join);
  certificate.solved_min_weight = seen.low;
  certificate.solved_max_weight = seen.high;
  certificate.solved_row_sum_error = std::max(certificate.solved_row_sum_error, seen.error);
}

/// What some of the nodes store.
struct Stored {
  std::vector<std::size_t> count;  // of each node
  std::vector<std::uint16_t> segment;
  std::vector<float> weight;
  double row_sum_error = 0;
};

/// Rows cut at kStored, divided by their sum and narrowed to float32; `source` as in attachments().
Stored store_some(const Range& nodes, const solve::Block& values, const std::vector<std::int32_t>& columns,
                  const std::vector<std::int32_t>& source) {
  Stored out;
  for (std::size_t n = nodes.begin(); n < nodes.end(); ++n) {
    const auto row = values.row(source[n] >= 0 ? source[n] : static_cast<Eigen::Index>(n));
    const std::size_t before = out.segment.size();
    double kept = 0;
    for (const double x : row) kept += x >= kStored ? x : 0;
    double sum = 0;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const double x = row(static_cast<Eigen::Index>(c));
      const auto narrow = static_cast<float>(x / kept);
      if (x < kStored || static_cast<double>(narrow) < kStored) continue;  // narrowing may round 1e-6 down
      out.segment.push_back(static_cast<std::uint16_t>(columns[c]));
      out.weight.push_back(narrow);
      sum += narrow;
    }
    out.row_sum_error = std::max(out.row_sum_error, std::abs(sum - 1));
    out.count.push_back(out.segment.size() - before);
  }
  return out;
}

Weights store(const solve::Block& values, const std::vector<std::int32_t>& columns,
              const std::vector<std::int32_t>& source, Certificate& certificate) {
  const std::size_t nodes = source.size();
  std::vector<Stored> pieces((nodes + kPiece - 1) / kPiece);
  tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t p) {
    pieces[p] = store_some({p * kPiece, std::min((p + 1) * kPiece, nodes)}, values, columns, source);
  });
  Weights w;
  w.offsets.reserve(nodes + 1);
  w.offsets.push_back(0);
  for (const Stored& piece : pieces) {
    for (const std::size_t count : piece.count) w.offsets.push_back(w.offsets.back() + count);
    certificate.row_sum_error = std::max(certificate.row_sum_error, piece.row_sum_error);
  }
  w.segment.reserve(w.offsets.back());
  w.weight.reserve(w.offsets.back());
  for (Stored& piece : pieces) {
    w.segment.insert(w.segment.end(), piece.segment.begin(), piece.segment.end());
    w.weight.insert(w.weight.end(), piece.weight.begin(), piece.weight.end());
    piece = {};
  }
  certificate.min_weight = 1;
  certificate.max_weight = 0;
  for (const float x : w.weight) {
    certificate.min_weight = std::min(certificate.min_weight, static_cast<double>(x));
    certificate.max_weight = std::max(certificate.max_weight, static_cast<double>(x));
  }
  return w;
}

}  // namespace

std::vector<std::string_view> kind_names() {
  return {"harmonic", "quasi-harmonic"};
}

Kind kind_from_name(std::string_view name) {
  if (name == "harmonic") return Kind::harmonic;
  if (name == "quasi-harmonic") return Kind::quasi_harmonic;
  throw Error(ErrorKind::usage, "--weights", "there are no weights '" + std::string(name) + "'",
              "use harmonic or quasi-harmonic");
}

WeightsResult solve_weights(const TetMesh& mesh, const Case& patient,
                            const std::vector<std::int32_t>& bone_segment, std::size_t segments,
                            const Options& options, const Context& context) {
  make_solver(options.solver);  // refuses an unknown name before anything slow
  const auto nodes = static_cast<std::size_t>(mesh.V.rows());
  WeightsResult result;
  Certificate& certificate = result.certificate;

  warn_of_untouched_bones(mesh, patient, context);
  std::vector<std::int32_t> owner;
  Parts parts;
  tbb::parallel_invoke([&] { owner = bone_nodes(mesh, patient, bone_segment); },
                       [&] { parts = connected_parts(mesh.V.rows(), mesh.T); });
  const std::vector<std::int32_t> columns = live_segments(owner, segments);
  if (columns.empty()) {
    throw Error(ErrorKind::data, "weights", "no tet lies in a bone",
                "use a finer --voxel, or check where the bones lie");
  }
  std::vector<std::uint8_t> boned(static_cast<std::size_t>(parts.count), 0);
  for (std::size_t n = 0; n < nodes; ++n) {
    if (owner[n] >= 0) boned[static_cast<std::size_t>(parts.of_node[n])] = 1;
  }
  const std::vector<std::int32_t> source = attachments(mesh.V, parts, boned, context);
  context.report(0.1);
  context.check_stop();

  solve::SparseMatrix L = stiffness(mesh.V, mesh.T, {}, &certificate.positive_offdiagonal_share);
  context.report(0.2);
  context.check_stop();

  // Nodes that touch a bone are fixed; so are those of boneless parts, which nothing else would hold.
  std::vector<std::uint8_t> fixed(nodes, 0);
  std::vector<Eigen::Index> column_of(segments, -1);
  for (std::size_t c = 0; c < columns.size(); ++c)
    column_of[static_cast<std::size_t>(columns[c])] = static_cast<Eigen::Index>(c);
  solve::Block boundary(mesh.V.rows(), static_cast<Eigen::Index>(columns.size()));
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, nodes, 4096), [&](const auto& range) {
    for (std::size_t n = range.begin(); n < range.end(); ++n) {
      fixed[n] = owner[n] >= 0 || source[n] >= 0;
      auto row = boundary.row(static_cast<Eigen::Index>(n));
      row.setZero();
      if (owner[n] >= 0) row[column_of[static_cast<std::size_t>(owner[n])]] = 1;
    }
  });
  const auto unknowns = std::count(fixed.begin(), fixed.end(), std::uint8_t{0});
  result.solver = options.solver == "auto" ? solver_for(unknowns) : options.solver;
  const auto solver = make_solver(result.solver);
  Context scaled = context.quiet();
  scaled.progress = [&](double fraction) { context.report(0.2 + 0.7 * fraction); };
  MonotoneResult monotone = solve_monotone(L, fixed, std::move(boundary), *solver, scaled);
  certify_mending(monotone, certificate);
  if (options.kind == Kind::quasi_harmonic && monotone.violation <= kSmallViolation) {
    context.check_stop();
    solve::SparseMatrix().swap(L);
    solve::SparseMatrix bent =
        stiffness(mesh.V, mesh.T, quasi_harmonic_conductivity(mesh.T, monotone.harmonic.values), nullptr);
    monotone = solve_monotone(bent, fixed, std::move(monotone.harmonic.values), *solver, context.quiet());
    certify_mending(monotone, certificate);
  }
  if (monotone.violation > kSmallViolation) {
    refuse(mesh, monotone.worst_node, monotone.violation, monotone.mended_nodes);
  }
  warn_of_mended_nodes(monotone, context);
  HarmonicResult& solved = monotone.harmonic;
  certificate.solver_residual = solved.residual;
  measure_solved(solved.values, source, certificate);
  if (options.keep_solved) {
    result.solved.setZero(mesh.V.rows(), static_cast<Eigen::Index>(segments));
    for (std::size_t c = 0; c < columns.size(); ++c) {
      result.solved.col(columns[c]) = solved.values.col(static_cast<Eigen::Index>(c));
    }
  }
  context.report(0.9);

  solve::Block& values = solved.values;
  const Repair repaired = repair(fixed, values);
  certificate.repaired_rows = repaired.rows;
  certificate.repaired_largest_change = repaired.largest_change;
  if (repaired.largest_change > kLargestChange) {
    refuse(mesh, repaired.worst_node, repaired.largest_change, static_cast<std::int64_t>(repaired.rows));
  }
  context.check_stop();
  result.weights = store(values, columns, source, certificate);
  context.report(1);
  return result;
}

}  // namespace ecorche::weights
