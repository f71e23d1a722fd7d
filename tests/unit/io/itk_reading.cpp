// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/io/itk_reading.hpp"

// First: it makes ITK usable by other compilers than gcc.
#include "io/image/itk_compilers.hpp"

#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkVectorLinearInterpolateImageFunction.h>

namespace ecorche::foreign {

Displacement itk_displacement(const std::filesystem::path& path, const std::array<std::int64_t, 3>& index) {
  using Image = itk::Image<itk::Vector<float, 3>, 3>;
  const auto reader = itk::ImageFileReader<Image>::New();
  itk::ImageIOBase::Pointer io = itk::NrrdImageIO::New().GetPointer();
  if (path.extension() == ".mha") io = itk::MetaImageIO::New().GetPointer();
  if (path.extension() == ".gz") io = itk::NiftiImageIO::New().GetPointer();
  reader->SetImageIO(io);
  reader->SetFileName(path.string());
  reader->Update();
  const Image::IndexType at{index[0], index[1], index[2]};
  const Image::PixelType pixel = reader->GetOutput()->GetPixel(at);
  Image::PointType point;
  reader->GetOutput()->TransformIndexToPhysicalPoint(at, point);
  const auto interpolator = itk::VectorLinearInterpolateImageFunction<Image, double>::New();
  interpolator->SetInputImage(reader->GetOutput());
  const auto probed = interpolator->Evaluate(point);
  Displacement out{};
  for (unsigned k = 0; k < 3; ++k) {
    out.vector[k] = static_cast<double>(pixel[k]);
    out.point[k] = point[k];
    out.probed[k] = probed[k];
  }
  return out;
}

}  // namespace ecorche::foreign
