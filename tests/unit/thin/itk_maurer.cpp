// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/thin/itk_maurer.hpp"

// First: it makes ITK usable by other compilers than gcc.
#include "io/image/itk_compilers.hpp"

#include <itkImage.h>
#include <itkSignedMaurerDistanceMapImageFilter.h>

namespace ecorche::foreign {

std::vector<double> maurer_squared(const ImageGrid& grid, const std::vector<std::uint8_t>& inside) {
  using Bytes = itk::Image<unsigned char, 3>;
  using Reals = itk::Image<double, 3>;
  const auto image = Bytes::New();
  Bytes::SizeType size;
  Bytes::SpacingType spacing;
  for (unsigned a = 0; a < 3; ++a) {
    size[a] = static_cast<itk::SizeValueType>(grid.size[a]) + 2;  // the background around the image
    spacing[a] = grid.spacing[a];
  }
  image->SetRegions(size);
  image->SetSpacing(spacing);
  image->Allocate();
  image->FillBuffer(1);  // its object is our background: the map is positive outside of it
  const auto each = [&](auto&& f) {
    std::size_t at = 0;
    for (int k = 0; k < grid.size[2]; ++k) {
      for (int j = 0; j < grid.size[1]; ++j) {
        for (int i = 0; i < grid.size[0]; ++i, ++at) f(Bytes::IndexType{{i + 1, j + 1, k + 1}}, at);
      }
    }
  };
  each([&](const Bytes::IndexType& index, std::size_t at) { image->SetPixel(index, inside[at] == 0); });
  const auto filter = itk::SignedMaurerDistanceMapImageFilter<Bytes, Reals>::New();
  filter->SetInput(image);
  filter->SquaredDistanceOn();
  filter->UseImageSpacingOn();
  filter->InsideIsPositiveOff();
  filter->Update();
  std::vector<double> out(inside.size());
  each([&](const Bytes::IndexType& index, std::size_t at) {
    out[at] = inside[at] == 0 ? 0 : filter->GetOutput()->GetPixel(index);
  });
  return out;
}

}  // namespace ecorche::foreign
