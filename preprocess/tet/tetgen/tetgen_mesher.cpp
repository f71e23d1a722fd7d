// SPDX-License-Identifier: AGPL-3.0-or-later
// Constrained Delaunay tets between the surfaces of skin and bones, by TetGen in a process of its own.
#define TETLIBRARY
#include <tetgen.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "preprocess/tet/mesher.hpp"
#include "preprocess/tet/tetgen/child_process.hpp"
#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::tet {
namespace {

/// Tets no larger than a cube of this many voxels' volume, however many are allowed.
constexpr double kFinestVolumeInVoxels = 12;

/// Skin and bones as one piecewise linear complex: triangles over shared vertices, each once.
struct Complex {
  std::vector<double> points;  // 3 a vertex
  std::vector<std::array<int, 3>> triangles;
  std::size_t vertices() const { return points.size() / 3; }
};

class ComplexBuilder {
 public:
  void add(const SurfaceMesh& surface) {
    for (Eigen::Index f = 0; f < surface.F.rows(); ++f) {
      std::array<int, 3> t{};
      for (std::size_t c = 0; c < 3; ++c)
        t[c] = vertex(surface.V.row(surface.F(f, static_cast<Eigen::Index>(c))));
      std::array<int, 3> sorted = t;
      std::sort(sorted.begin(), sorted.end());
      if (sorted[0] == sorted[1] || sorted[1] == sorted[2]) continue;
      if (seen_.insert(sorted).second) complex_.triangles.push_back(t);
    }
  }
  Complex take() { return std::move(complex_); }

 private:
  template <class Row>
  int vertex(const Row& p) {
    const auto [entry, fresh] =
        number_.try_emplace({p[0], p[1], p[2]}, static_cast<int>(complex_.vertices()));
    if (fresh) complex_.points.insert(complex_.points.end(), {p[0], p[1], p[2]});
    return entry->second;
  }
  Complex complex_;
  std::map<std::array<double, 3>, int> number_;
  std::set<std::array<int, 3>> seen_;
};

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

std::vector<std::byte> tetrahedralize_complex(const Complex& complex, double largest_volume) {
  std::vector<tetgenio::facet> facets(complex.triangles.size());
  std::vector<tetgenio::polygon> polygons(complex.triangles.size());
  std::vector<std::array<int, 3>> corners = complex.triangles;
  std::vector<double> points = complex.points;
  for (std::size_t f = 0; f < facets.size(); ++f) {
    polygons[f] = {corners[f].data(), 3};
    facets[f] = {&polygons[f], 1, nullptr, 0};
  }
  tetgenio in, out;
  in.pointlist = points.data();
  in.numberofpoints = static_cast<int>(complex.vertices());
  in.facetlist = facets.data();
  in.numberoffacets = static_cast<int>(facets.size());
  // p: of a complex; Y: surfaces stay as they are; q: radius-edge ratio / smallest dihedral angle, where the
  // surfaces allow it; A: regions are numbered; z: from 0; Q: quiet; a: largest volume.
  std::string switches = "pYq1.414/15AzQa" + std::to_string(largest_volume);
  tetrahedralize(switches.data(), &in, &out);
  Raw raw;
  raw.points.assign(out.pointlist, out.pointlist + 3 * static_cast<std::ptrdiff_t>(out.numberofpoints));
  raw.corners.assign(out.tetrahedronlist,
                     out.tetrahedronlist + 4 * static_cast<std::ptrdiff_t>(out.numberoftetrahedra));
  raw.regions.resize(static_cast<std::size_t>(out.numberoftetrahedra));
  for (std::size_t t = 0; t < raw.regions.size(); ++t)
    raw.regions[t] = static_cast<int>(
        out.tetrahedronattributelist[t * static_cast<std::size_t>(out.numberoftetrahedronattributes)]);
  in.initialize();  // the arrays are not TetGen's to delete
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
void label_regions(TetMesh& mesh, const std::vector<int>& regions, const Image& labels) {
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

Error refusal(std::string what) {
  return {ErrorKind::data, "tetgen", std::move(what), "use --mesher cgal, which works from the voxels"};
}

class TetgenMesher : public Mesher {
 public:
  std::string_view name() const override { return "tetgen"; }

  TetMesh mesh(const Input& input, const Options& options, const Context& context) const override {
    ComplexBuilder builder;
    builder.add(input.patient.skin);
    for (const CaseBone& bone : input.patient.bones) builder.add(bone.surface);
    const Complex complex = builder.take();
    if (static_cast<std::int64_t>(complex.vertices()) > options.max_nodes)
      throw refusal("skin and bones have " + std::to_string(complex.vertices()) +
                    " vertices, all of which it keeps, and " + std::to_string(options.max_nodes) +
                    " nodes are allowed");
    const double body = body_volume(input.labels);
    // Refined tets have about half the largest volume; the other half of the budget is for those at surfaces.
    double volume = std::max(kFinestVolumeInVoxels * std::pow(input.labels.grid.spacing[0], 3),
                             4 * body / static_cast<double>(options.max_tets));
    for (;;) {
      const ChildResult result = run_in_child([&] { return tetrahedralize_complex(complex, volume); },
                                              {.seconds = options.seconds}, context);
      if (result.end == ChildResult::End::timed_out)
        throw refusal("TetGen did not come back within " + std::to_string(static_cast<int>(options.seconds)) +
                      " s");
      if (result.end == ChildResult::End::failed)
        throw refusal(
            "TetGen could not fill the surfaces (" +
            (result.said.empty() ? std::string("they may touch, cross or stay open") : result.said) + ")");
      std::vector<int> regions;
      TetMesh mesh = unpack(result.bytes, regions);
      if (mesh.T.rows() == 0) throw refusal("the skin does not close, so that TetGen found no inside");
      const double excess =
          std::max(static_cast<double>(mesh.T.rows()) / static_cast<double>(options.max_tets),
                   static_cast<double>(mesh.V.rows()) / static_cast<double>(options.max_nodes));
      if (excess <= 1) {
        label_regions(mesh, regions, input.labels);
        context.report(1);
        return mesh;
      }
      const std::string made = "TetGen made " + std::to_string(mesh.T.rows()) + " tets and " +
                               std::to_string(mesh.V.rows()) + " nodes, more than allowed";
      if (volume > body) throw refusal(made + ", even without a limit on their volume");
      volume *= 2 * excess * excess;
      context.warn(made + ": again with tets up to " + std::to_string(volume) + " mm^3");
    }
  }
};

}  // namespace

std::unique_ptr<Mesher> make_tetgen_mesher() {
  return std::make_unique<TetgenMesher>();
}

}  // namespace ecorche::tet
