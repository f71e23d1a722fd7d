// SPDX-License-Identifier: Apache-2.0
#include "bench/runtime/peers.hpp"

// First of ITK's: it makes ITK usable by other compilers than gcc.
#include "io/image/itk_compilers.hpp"

#include <itkImage.h>
#include <itkVector.h>
#include <itkVersion.h>
#include <itkWarpImageFilter.h>

#include <algorithm>
#include <chrono>

namespace ecorche::bench {
namespace {

template <class Image>
typename Image::Pointer image_on(const PosedGrid& grid) {
  const auto image = Image::New();
  typename Image::SizeType size;
  for (unsigned a = 0; a < 3; ++a) size[a] = static_cast<itk::SizeValueType>(grid.size[a]);
  image->SetRegions(size);
  image->SetSpacing(grid.spacing.data());
  image->SetOrigin(grid.origin.data());
  image->Allocate();
  return image;
}

}  // namespace

ItkWarped warp_by_itk(const PosedGrid& grid) {
  using Bytes = itk::Image<unsigned char, 3>;
  using Field = itk::Image<itk::Vector<float, 3>, 3>;
  const auto volume = image_on<Bytes>(grid);
  std::copy(grid.volume.begin(), grid.volume.end(), volume->GetBufferPointer());
  const auto field = image_on<Field>(grid);
  for (std::size_t v = 0; v < grid.volume.size(); ++v) field->GetBufferPointer()[v] = &grid.field[3 * v];
  const auto filter = itk::WarpImageFilter<Bytes, Bytes, Field>::New();
  filter->SetInput(volume);
  filter->SetDisplacementField(field);
  filter->SetOutputParametersFromImage(field);
  ItkWarped out;
  out.name = std::string("ITK ") + itk::Version::GetITKVersion() + " WarpImageFilter, handed the field";
  const auto start = std::chrono::steady_clock::now();
  filter->Update();
  out.ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  const unsigned char* values = filter->GetOutput()->GetBufferPointer();
  out.values.assign(values, values + grid.volume.size());
  return out;
}

}  // namespace ecorche::bench
