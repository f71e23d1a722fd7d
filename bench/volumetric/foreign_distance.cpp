// SPDX-License-Identifier: Apache-2.0
#include "bench/volumetric/foreign_distance.hpp"

// First: it makes ITK usable by other compilers than gcc.
#include "io/image/itk_compilers.hpp"

#include <itkImage.h>
#include <itkSignedMaurerDistanceMapImageFilter.h>
#include <vtkImageData.h>
#include <vtkImageEuclideanDistance.h>
#include <vtkNew.h>
#include <vtkPointData.h>

#include <chrono>

namespace ecorche::bench {
namespace {

template <class F>
double seconds_of(F&& f) {
  const auto start = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

ForeignDistance itk_distance(const std::array<std::int32_t, 3>& size,
                             const std::vector<std::uint8_t>& inside) {
  using Bytes = itk::Image<unsigned char, 3>;
  using Reals = itk::Image<float, 3>;
  const auto image = Bytes::New();
  Bytes::SizeType extent;
  for (unsigned a = 0; a < 3; ++a) extent[a] = static_cast<itk::SizeValueType>(size[a]);
  image->SetRegions(extent);
  image->Allocate();
  // Its object is our background: the map is positive outside of it.
  for (std::size_t v = 0; v < inside.size(); ++v) image->GetBufferPointer()[v] = inside[v] == 0;
  const auto filter = itk::SignedMaurerDistanceMapImageFilter<Bytes, Reals>::New();
  filter->SetInput(image);
  filter->SquaredDistanceOn();
  filter->UseImageSpacingOff();
  ForeignDistance out;
  out.seconds = seconds_of([&] { filter->Update(); });
  const float* values = filter->GetOutput()->GetBufferPointer();
  out.squares.assign(values, values + inside.size());
  for (std::size_t v = 0; v < inside.size(); ++v) {
    if (inside[v] == 0) out.squares[v] = 0;
  }
  return out;
}

ForeignDistance vtk_distance(const std::array<std::int32_t, 3>& size,
                             const std::vector<std::uint8_t>& inside) {
  vtkNew<vtkImageData> image;
  image->SetDimensions(size[0], size[1], size[2]);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  std::copy(inside.begin(), inside.end(), static_cast<unsigned char*>(image->GetScalarPointer()));
  vtkNew<vtkImageEuclideanDistance> filter;
  filter->SetInputData(image);
  filter->SetAlgorithmToSaito();
  filter->SetConsiderAnisotropy(0);
  ForeignDistance out;
  out.seconds = seconds_of([&] { filter->Update(); });
  const auto* values = static_cast<const double*>(filter->GetOutput()->GetScalarPointer());
  out.squares.assign(values, values + inside.size());
  return out;
}

}  // namespace ecorche::bench
