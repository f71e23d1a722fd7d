// SPDX-License-Identifier: Apache-2.0
#include <vtkCellArray.h>
#include <vtkCellType.h>
#include <vtkCharArray.h>
#include <vtkFloatArray.h>
#include <vtkIdTypeArray.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkMatrixToLinearTransform.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkProbeFilter.h>
#include <vtkUnsignedShortArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkVersion.h>
#include <vtkWeightedTransformFilter.h>

#include <algorithm>
#include <chrono>

#include "bench/runtime/peers.hpp"

namespace ecorche::bench {
namespace {

std::string named(const char* what) {
  return std::string("VTK ") + vtkVersion::GetVTKVersion() + " " + what;
}

vtkNew<vtkPoints> points_of(std::span<const float> at) {
  vtkNew<vtkPoints> out;
  out->SetDataTypeToFloat();
  out->SetNumberOfPoints(static_cast<vtkIdType>(at.size() / 3));
  std::copy(at.begin(), at.end(), static_cast<float*>(out->GetVoidPointer(0)));
  return out;
}

class WeightedTransforms final : public SkinningPeer {
 public:
  explicit WeightedTransforms(const HungPoints& points) {
    name = named("vtkWeightedTransformFilter");
    std::size_t most = 0;
    for (std::size_t p = 0; p < points.points(); ++p)
      most = std::max<std::size_t>(most, points.begin[p + 1] - points.begin[p]);
    vtkNew<vtkFloatArray> weights;
    vtkNew<vtkUnsignedShortArray> which;
    weights->SetName("weights");
    which->SetName("which");
    for (vtkDataArray* array : {static_cast<vtkDataArray*>(weights), static_cast<vtkDataArray*>(which)}) {
      array->SetNumberOfComponents(static_cast<int>(most));
      array->SetNumberOfTuples(static_cast<vtkIdType>(points.points()));
    }
    for (std::size_t p = 0; p < points.points(); ++p) {
      for (std::size_t i = 0; i < most; ++i) {
        const std::size_t e = points.begin[p] + i;
        const bool there = e < points.begin[p + 1];
        weights->SetValue(static_cast<vtkIdType>(most * p + i), there ? points.weight[e] : 0);
        which->SetValue(static_cast<vtkIdType>(most * p + i), there ? points.segment[e] : 0);
      }
    }
    vtkNew<vtkPolyData> body;
    body->SetPoints(points_of(points.at));
    body->GetPointData()->AddArray(weights);
    body->GetPointData()->AddArray(which);
    filter_->SetInputData(body);
    filter_->SetWeightArray("weights");
    filter_->SetTransformIndexArray("which");
    filter_->SetNumberOfTransforms(static_cast<int>(points.segments));
    matrices_.resize(points.segments);
    for (std::size_t s = 0; s < points.segments; ++s) {
      matrices_[s] = vtkSmartPointer<vtkMatrix4x4>::New();
      vtkNew<vtkMatrixToLinearTransform> transform;
      transform->SetInput(matrices_[s]);
      filter_->SetTransform(transform, static_cast<int>(s));
    }
  }

  void pose(std::span<const Motion> motions) override {
    for (std::size_t s = 0; s < motions.size(); ++s) {
      const auto [w, x, y, z] = motions[s].turn;
      const std::array<double, 3>& t = motions[s].shift;
      const double rows[16] = {1 - 2 * (y * y + z * z),
                               2 * (x * y - w * z),
                               2 * (x * z + w * y),
                               t[0],
                               2 * (x * y + w * z),
                               1 - 2 * (x * x + z * z),
                               2 * (y * z - w * x),
                               t[1],
                               2 * (x * z - w * y),
                               2 * (y * z + w * x),
                               1 - 2 * (x * x + y * y),
                               t[2],
                               0,
                               0,
                               0,
                               1};
      matrices_[s]->DeepCopy(rows);
    }
    filter_->Modified();
    filter_->Update();
  }

  std::array<double, 3> at(std::size_t point) const override {
    std::array<double, 3> out{};
    filter_->GetOutput()->GetPoint(static_cast<vtkIdType>(point), out.data());
    return out;
  }

 private:
  mutable vtkNew<vtkWeightedTransformFilter> filter_;
  std::vector<vtkSmartPointer<vtkMatrix4x4>> matrices_;
};

}  // namespace

void add_vtk(const HungPoints& points, Peers& out) {
  out.push_back(std::make_unique<WeightedTransforms>(points));
}

VtkProbed probe_by_vtk(const PosedGrid& grid) {
  const auto tets = static_cast<vtkIdType>(grid.tets.size() / 4);
  vtkNew<vtkIdTypeArray> corners;
  corners->SetNumberOfValues(4 * tets);
  std::copy(grid.tets.begin(), grid.tets.end(), corners->GetPointer(0));
  vtkNew<vtkCellArray> cells;
  cells->SetData(4, corners);
  vtkNew<vtkFloatArray> rest;
  rest->SetName("rest");
  rest->SetNumberOfComponents(3);
  rest->SetNumberOfTuples(static_cast<vtkIdType>(grid.rest.size() / 3));
  std::copy(grid.rest.begin(), grid.rest.end(), rest->GetPointer(0));
  vtkNew<vtkUnstructuredGrid> body;
  body->SetPoints(points_of(grid.posed));
  body->SetCells(VTK_TETRA, cells);
  body->GetPointData()->AddArray(rest);
  vtkNew<vtkImageData> where;
  where->SetDimensions(grid.size.data());
  where->SetSpacing(grid.spacing.data());
  where->SetOrigin(grid.origin.data());

  vtkNew<vtkProbeFilter> probe;
  probe->SetInputData(where);
  probe->SetSourceData(body);
  VtkProbed out;
  out.name = named("vtkProbeFilter");
  const auto start = std::chrono::steady_clock::now();
  probe->Update();
  out.ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  vtkDataSet* found = probe->GetOutput();
  const auto voxels = static_cast<std::size_t>(found->GetNumberOfPoints());
  const float* places =
      vtkArrayDownCast<vtkFloatArray>(found->GetPointData()->GetArray("rest"))->GetPointer(0);
  const char* mask =
      vtkArrayDownCast<vtkCharArray>(found->GetPointData()->GetArray(probe->GetValidPointMaskArrayName()))
          ->GetPointer(0);
  out.rest.assign(places, places + 3 * voxels);
  out.held.assign(mask, mask + voxels);
  return out;
}

}  // namespace ecorche::bench
