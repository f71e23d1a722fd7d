// SPDX-License-Identifier: AGPL-3.0-or-later
// Constrained Delaunay tets between the surfaces of skin and bones, by TetGen in a process of its own.
#define TETLIBRARY
#include <tetgen.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "core/platform/child_process.hpp"
#include "preprocess/tet/mesher.hpp"
#include "preprocess/tet/tetgen/complex.hpp"
#include "preprocess/tet/tetgen/split_edges.hpp"
#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::tet {
namespace {

/// Tets no larger than a cube of this many voxels' volume, however many are allowed.
constexpr double kFinestVolumeInVoxels = 12;
/// Edges of the surfaces are halved down to this length, as far as the budget goes.
constexpr double kLongestEdgeInVoxels = 2;
/// A budget of tets for each vertex of the surfaces; about 7 are the least, the others fill the inside.
constexpr std::int64_t kTetsPerSurfaceVertex = 20;

platform::ChildOptions child_options(double seconds) {
  return {.seconds = seconds, .mend = "free some memory and try again, or use another mesher"};
}

/// TetGen's result as it crosses from the child: two counts, then points, corners and regions.
struct Raw {
  std::vector<double> points;  // 3 a node
  std::vector<int> corners;    // 4 a tet
  std::vector<int> regions;    // 1 a tet
};

template <class T>
void put(std::vector<std::byte>& bytes, const std::vector<T>& values) {
  const std::uint64_t count = values.size();
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof count + count * sizeof(T));
  std::memcpy(bytes.data() + at, &count, sizeof count);
  if (count > 0) std::memcpy(bytes.data() + at + sizeof count, values.data(), count * sizeof(T));
}

template <class T>
void get(const std::vector<std::byte>& bytes, std::size_t& at, std::vector<T>& values) {
  std::uint64_t count = 0;
  std::memcpy(&count, bytes.data() + at, sizeof count);
  values.resize(count);
  if (count > 0) std::memcpy(values.data(), bytes.data() + at + sizeof count, count * sizeof(T));
  at += sizeof count + count * sizeof(T);
}

/// A complex in TetGen's own arrays, which stay ours.
class TetgenInput {
 public:
  explicit TetgenInput(const Complex& complex)
      : points_(complex.points),
        corners_(complex.triangles),
        polygons_(corners_.size()),
        facets_(corners_.size()) {
    for (std::size_t f = 0; f < facets_.size(); ++f) {
      polygons_[f] = {corners_[f].data(), 3};
      facets_[f] = {&polygons_[f], 1, nullptr, 0};
    }
    for (const Complex::Seed& seed : complex.seeds)
      regions_.insert(regions_.end(), {seed.point[0], seed.point[1], seed.point[2], 1.0 + seed.label, -1.0});
    in_.pointlist = points_.data();
    in_.numberofpoints = static_cast<int>(complex.vertices());
    in_.facetlist = facets_.data();
    in_.numberoffacets = static_cast<int>(facets_.size());
    in_.regionlist = regions_.empty() ? nullptr : regions_.data();
    in_.numberofregions = static_cast<int>(complex.seeds.size());
  }
  ~TetgenInput() { in_.initialize(); }  // or TetGen would delete the arrays
  TetgenInput(const TetgenInput&) = delete;
  TetgenInput& operator=(const TetgenInput&) = delete;

  void run(std::string switches, tetgenio& out) { tetrahedralize(switches.data(), &in_, &out); }

 private:
  std::vector<double> points_, regions_;
  std::vector<std::array<int, 3>> corners_;
  std::vector<tetgenio::polygon> polygons_;
  std::vector<tetgenio::facet> facets_;
  tetgenio in_;
};

/// The number of triangles that cross others, as bytes.
std::vector<std::byte> count_crossings(const Complex& complex) {
  tetgenio out;
  TetgenInput(complex).run("pdQ", out);
  std::vector<std::byte> bytes;
  put(bytes, std::vector<int>{out.numberoftrifaces});
  return bytes;
}

std::vector<std::byte> fill_in_child(const Complex& complex, double largest_volume) {
  // p: of a complex; Y: surfaces stay as they are; q: radius-edge ratio / smallest dihedral angle, where the
  // surfaces allow it; A: regions are numbered; z: from 0; Q: quiet; a: largest volume.
  tetgenio out;
  TetgenInput(complex).run("pYq1.414/15AzQa" + std::to_string(largest_volume), out);
  Raw raw;
  raw.points.assign(out.pointlist, out.pointlist + 3 * static_cast<std::ptrdiff_t>(out.numberofpoints));
  raw.corners.assign(out.tetrahedronlist,
                     out.tetrahedronlist + 4 * static_cast<std::ptrdiff_t>(out.numberoftetrahedra));
  raw.regions.resize(static_cast<std::size_t>(out.numberoftetrahedra));
  for (std::size_t t = 0; t < raw.regions.size(); ++t)
    raw.regions[t] = static_cast<int>(
        out.tetrahedronattributelist[t * static_cast<std::size_t>(out.numberoftetrahedronattributes)]);
  std::vector<std::byte> bytes;
  put(bytes, raw.points);
  put(bytes, raw.corners);
  put(bytes, raw.regions);
  return bytes;
}

TetMesh unpack(const std::vector<std::byte>& bytes, std::vector<int>& regions) {
  Raw raw;
  std::size_t at = 0;
  get(bytes, at, raw.points);
  get(bytes, at, raw.corners);
  get(bytes, at, raw.regions);
  TetMesh mesh;
  mesh.V = Eigen::Map<const Points>(raw.points.data(), static_cast<Eigen::Index>(raw.points.size() / 3), 3);
  mesh.T = Eigen::Map<const Tets>(raw.corners.data(), static_cast<Eigen::Index>(raw.corners.size() / 4), 4);
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    if (tet_det(mesh.V.row(mesh.T(t, 0)), mesh.V.row(mesh.T(t, 1)), mesh.V.row(mesh.T(t, 2)),
                mesh.V.row(mesh.T(t, 3))) < 0)
      std::swap(mesh.T(t, 2), mesh.T(t, 3));
  regions = std::move(raw.regions);
  return mesh;
}

std::uint16_t voxel_at(const Image& labels, const Eigen::Vector3d& p) {
  const std::array<double, 3> index = labels.grid.index({p[0], p[1], p[2]});
  std::int32_t voxel[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    voxel[axis] = static_cast<std::int32_t>(std::lround(index[axis]));
    if (voxel[axis] < 0 || voxel[axis] >= labels.grid.size[axis]) return voxel::outside;
  }
  return labels.scalars<std::uint16_t>()[labels.grid.offset(voxel[0], voxel[1], voxel[2])];
}

/// Each region between surfaces takes the label that most of its volume has in the image.
void label_by_image(TetMesh& mesh, const std::vector<int>& regions, const Image& labels) {
  std::map<int, std::map<std::uint16_t, double>> votes;
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    const auto a = mesh.V.row(mesh.T(t, 0)), b = mesh.V.row(mesh.T(t, 1));
    const auto c = mesh.V.row(mesh.T(t, 2)), d = mesh.V.row(mesh.T(t, 3));
    const std::uint16_t seen = std::max(voxel::soft, voxel_at(labels, 0.25 * (a + b + c + d).transpose()));
    votes[regions[static_cast<std::size_t>(t)]][seen] += tet_det(a, b, c, d);
  }
  std::map<int, std::uint16_t> label;
  for (const auto& [region, seen] : votes)
    label[region] = std::max_element(seen.begin(), seen.end(), [](const auto& x, const auto& y) {
                      return x.second < y.second;
                    })->first;
  mesh.label.resize(regions.size());
  for (std::size_t t = 0; t < regions.size(); ++t)
    mesh.label[t] = static_cast<std::uint16_t>(label[regions[t]] - voxel::soft);
}

double body_volume(const Image& labels) {
  const std::span<const std::uint16_t> voxels = labels.scalars<std::uint16_t>();
  const auto outside = std::count(voxels.begin(), voxels.end(), voxel::outside);
  return static_cast<double>(static_cast<std::ptrdiff_t>(voxels.size()) - outside) *
         std::pow(labels.grid.spacing[0], 3);
}

double volume_of(const TetMesh& mesh) {
  double six = 0;
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    six += tet_det(mesh.V.row(mesh.T(t, 0)), mesh.V.row(mesh.T(t, 1)), mesh.V.row(mesh.T(t, 2)),
                   mesh.V.row(mesh.T(t, 3)));
  return six / 6;
}

class TetgenMesher : public Mesher {
 public:
  std::string_view name() const override { return "tetgen"; }

  TetMesh mesh(const Input& input, const Options& options, const Context& context) const override {
    const Deadline deadline(options.seconds);
    const double voxel = input.labels.grid.spacing[0];
    Complex complex = complex_of_surfaces(input.patient);
    std::string obstacle = obstacle_of(complex, options, deadline, context);
    if (obstacle.empty()) {
      // Surfaces coarser than the gaps between them leave slivers there.
      split_long_edges(complex, kLongestEdgeInVoxels * voxel,
                       static_cast<std::size_t>(
                           std::min(options.max_tets / kTetsPerSurfaceVertex, options.max_nodes / 4)));
      Filled filled = fill(complex, input, options, deadline.half(), context);
      if (filled.obstacle.empty()) return std::move(filled.mesh);
      obstacle = std::move(filled.obstacle);
    }
    context.warn(obstacle + ": TetGen fills the surfaces of the voxels instead");
    complex = complex_from_voxels(input, options, context);
    Filled filled = fill(complex, input, options, deadline, context);
    if (!filled.obstacle.empty())
      throw Error(ErrorKind::data, "tetgen", filled.obstacle,
                  "use --mesher cgal, which works from the voxels");
    return std::move(filled.mesh);
  }

 private:
  /// What is left of the time that was allowed.
  class Deadline {
   public:
    explicit Deadline(double seconds) : end_(Clock::now() + std::chrono::duration<double>(seconds)) {}
    double seconds() const { return std::max(0.0, (end_ - Clock::now()).count()); }
    Deadline half() const { return Deadline(0.5 * seconds()); }

   private:
    using Clock = std::chrono::steady_clock;
    std::chrono::time_point<Clock, std::chrono::duration<double>> end_;
  };

  struct Filled {
    TetMesh mesh;
    std::string obstacle;  ///< why there is none; else empty
  };

  static Filled fill(const Complex& complex, const Input& input, const Options& options,
                     const Deadline& deadline, const Context& context) {
    const double body = body_volume(input.labels);
    // Refined tets have about half the largest volume; the other half of the budget is for those at surfaces.
    double volume = std::max(kFinestVolumeInVoxels * std::pow(input.labels.grid.spacing[0], 3),
                             4 * body / static_cast<double>(options.max_tets));
    for (;;) {
      const double seconds = deadline.seconds();
      const platform::ChildResult result = platform::run_in_child(
          [&] { return fill_in_child(complex, volume); }, child_options(seconds), context);
      if (result.end == platform::ChildResult::End::timed_out)
        return {{}, "TetGen did not come back within " + std::to_string(std::lround(seconds)) + " s"};
      if (result.end == platform::ChildResult::End::failed)
        return {{},
                "TetGen could not fill the surfaces" + (result.said.empty() ? "" : " (" + result.said + ")")};
      std::vector<int> regions;
      Filled out{unpack(result.bytes, regions), ""};
      TetMesh& mesh = out.mesh;
      if (volume_of(mesh) < 0.5 * body)  // the bones alone, or nothing
        return {{}, "the skin does not close, so that TetGen found no inside"};
      const double excess =
          std::max(static_cast<double>(mesh.T.rows()) / static_cast<double>(options.max_tets),
                   static_cast<double>(mesh.V.rows()) / static_cast<double>(options.max_nodes));
      if (excess <= 1) {
        if (complex.seeds.empty()) {
          label_by_image(mesh, regions, input.labels);
        } else if (const Hollows hollows = label_by_seeds(mesh, regions, complex);
                   hollows.filled + hollows.left > 0) {
          context.info("tetgen: of the hollows between the voxels' surfaces " +
                       std::to_string(hollows.filled) + " are filled, " + std::to_string(hollows.left) +
                       " are not of the body");
        }
        context.report(1);
        return out;
      }
      const std::string made = "TetGen made " + std::to_string(mesh.T.rows()) + " tets and " +
                               std::to_string(mesh.V.rows()) + " nodes, more than allowed";
      if (volume > body) return {{}, made + ", even without a limit on their volume"};
      volume *= 2 * excess * excess;
      context.warn(made + ": again with tets up to " + std::to_string(volume) + " mm^3");
    }
  }

  /// Why TetGen cannot fill the surfaces themselves; empty where it can.
  static std::string obstacle_of(const Complex& complex, const Options& options, const Deadline& deadline,
                                 const Context& context) {
    if (5 * static_cast<std::int64_t>(complex.vertices()) > 4 * options.max_nodes ||
        7 * static_cast<std::int64_t>(complex.vertices()) >
            options.max_tets)  // at least about 7 tets a vertex, measured
      return "skin and bones have " + std::to_string(complex.vertices()) +
             " vertices, too many for the allowed tets";
    const platform::ChildResult check = platform::run_in_child(
        [&] { return count_crossings(complex); }, child_options(deadline.half().seconds()), context);
    if (check.end == platform::ChildResult::End::timed_out)
      return "looking for crossing surfaces took too long";
    if (check.end == platform::ChildResult::End::failed)
      return "skin and bones cannot be checked for crossings";
    std::size_t at = 0;
    std::vector<int> crossings;
    get(check.bytes, at, crossings);
    return crossings[0] == 0 ? ""
                             : std::to_string(crossings[0]) + " triangles of skin and bones cross others";
  }

  /// Boundaries between the labels, of a lattice as fine as a share of the budget allows: tets inside may be
  /// larger.
  static Complex complex_from_voxels(const Input& input, const Options& options, const Context& context) {
    Options share = options;
    share.max_tets = options.max_tets * 2 / 3;
    share.max_nodes = options.max_nodes * 2 / 3;
    const TetMesh lattice = make_lattice_mesher()->mesh(input, share, context);
    const double volume = tet_det(lattice.V.row(lattice.T(0, 0)), lattice.V.row(lattice.T(0, 1)),
                                  lattice.V.row(lattice.T(0, 2)), lattice.V.row(lattice.T(0, 3)));
    return complex_of_lattice(lattice, std::cbrt(2 * volume));  // six times side^3 / 12
  }
};

}  // namespace

std::unique_ptr<Mesher> make_tetgen_mesher() {
  return std::make_unique<TetgenMesher>();
}

}  // namespace ecorche::tet
