// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>
#include <vtkCellArray.h>
#include <vtkCellTreeLocator.h>
#include <vtkCellType.h>
#include <vtkFloatArray.h>
#include <vtkGenericCell.h>
#include <vtkIdTypeArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkStaticCellLocator.h>
#include <vtkUnstructuredGrid.h>
#include <vtkVersion.h>

#include <atomic>
#include <chrono>

#include "bench/preprocess/peers.hpp"

namespace ecorche::bench {
namespace {

template <class Locator>
double locate(vtkUnstructuredGrid* grid, const Points& points, std::int64_t& inside) {
  const auto start = std::chrono::steady_clock::now();
  vtkNew<Locator> locator;
  locator->SetDataSet(grid);
  locator->CacheCellBoundsOn();
  locator->BuildLocator();
  std::atomic<std::int64_t> found{0};
  constexpr Eigen::Index kPoints = 1024;
  tbb::parallel_for(Eigen::Index{0}, (points.rows() + kPoints - 1) / kPoints, [&](Eigen::Index part) {
    vtkNew<vtkGenericCell> cell;
    std::int64_t some = 0;
    for (Eigen::Index i = part * kPoints; i < std::min((part + 1) * kPoints, points.rows()); ++i) {
      double p[3] = {points(i, 0), points(i, 1), points(i, 2)}, pcoords[3], weights[8];
      some += locator->FindCell(p, 1e-12, cell, pcoords, weights) >= 0 ? 1 : 0;
    }
    found += some;
  });
  inside = found;
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

PeerRun vtk_locate(const Model& model, const Points& points, bool tree) {
  vtkNew<vtkPoints> nodes;
  vtkNew<vtkFloatArray> rows;
  rows->SetNumberOfComponents(3);
  rows->SetNumberOfTuples(model.nodes.rows());
  std::copy_n(model.nodes.data(), model.nodes.size(), rows->GetPointer(0));
  nodes->SetData(rows);
  vtkNew<vtkCellArray> cells;
  vtkNew<vtkIdTypeArray> corners;
  corners->SetNumberOfTuples(model.tets.size());
  std::copy_n(model.tets.data(), model.tets.size(), corners->GetPointer(0));
  cells->SetData(4, corners);
  vtkNew<vtkUnstructuredGrid> grid;
  grid->SetPoints(nodes);
  grid->SetCells(VTK_TETRA, cells);

  PeerRun run{std::string("VTK ") + vtkVersion::GetVTKVersion()};
  std::int64_t inside = 0;
  run.seconds = tree ? locate<vtkCellTreeLocator>(grid, points, inside)
                     : locate<vtkStaticCellLocator>(grid, points, inside);
  run.did = std::to_string(inside) + " of " + std::to_string(points.rows()) +
            " points in a cell; those outside get none";
  return run;
}

}  // namespace ecorche::bench
