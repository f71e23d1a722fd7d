// SPDX-License-Identifier: Apache-2.0
#include "io/image/itk_images.hpp"

// First: it makes ITK usable by other compilers than gcc.
#include "io/image/itk_compilers.hpp"

#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <iostream>
#include <mutex>
#include <sstream>

#include <ecorche/values/error.hpp>

namespace ecorche::io::itk_images {
namespace {

using Component = itk::IOComponentEnum;

// The image format objects themselves: no reader templates, no pixel conversion, no factories.
itk::ImageIOBase::Pointer make(Format format, const std::filesystem::path& path) {
  itk::ImageIOBase::Pointer io;
  switch (format) {
    case Format::nrrd:
      io = itk::NrrdImageIO::New();
      break;
    case Format::meta:
      io = itk::MetaImageIO::New();
      break;
    case Format::nifti:
      io = itk::NiftiImageIO::New();
      break;
  }
  io->SetFileName(path.string());
  return io;
}

// MetaIO and teem write their complaints on std::cerr, and so does ITK: kept here instead, until the call is
// over. Nothing of ours writes there.
class Complaints {
 public:
  Complaints() : shown_(itk::Object::GetGlobalWarningDisplay()), before_(std::cerr.rdbuf(&text_)) {
    itk::Object::SetGlobalWarningDisplay(false);
  }
  ~Complaints() {
    std::cerr.rdbuf(before_);
    itk::Object::SetGlobalWarningDisplay(shown_);
  }
  Complaints(const Complaints&) = delete;
  Complaints& operator=(const Complaints&) = delete;

 private:
  bool shown_;
  std::stringbuf text_;
  std::streambuf* before_;
};

// "itk::ERROR: NrrdImageIO(0x55e1): what" and lines of teem's become one line without addresses.
std::string one_line(std::string_view text) {
  const std::size_t address = text.find("(0x"), close = text.find("): ", address);
  if (address != text.npos && close != text.npos) text.remove_prefix(close + 3);
  std::string out;
  for (const char c : text) {
    if (c != '\n' && c != '\r' && c != '\t') {
      out += c;
    } else if (!out.empty() && out.back() != ' ') {
      out += ' ';
    }
  }
  return out.substr(0, out.find_last_not_of(' ') + 1);
}

template <class F>
auto guarded(ErrorKind kind, const std::filesystem::path& path, F&& f) {
  // What `Complaints` changes is the whole process's: one call at a time.
  static std::mutex one;
  const std::lock_guard lock(one);
  const Complaints kept;
  try {
    return f();
  } catch (const itk::ExceptionObject& error) {
    throw Error(kind, path.string(), one_line(error.GetDescription()),
                kind == ErrorKind::io ? "check the disk" : "write the image again");
  }
}

ScalarType scalar_type(Component component, const std::filesystem::path& path) {
  switch (component) {
    case Component::UCHAR:
      return ScalarType::u8;
    case Component::CHAR:
      return ScalarType::i8;
    case Component::USHORT:
      return ScalarType::u16;
    case Component::SHORT:
      return ScalarType::i16;
    case Component::UINT:
      return ScalarType::u32;
    case Component::INT:
    case Component::LONG:  // of 64 bits, as LONGLONG: handed on as i32
    case Component::LONGLONG:
    case Component::ULONG:
    case Component::ULONGLONG:
      return ScalarType::i32;
    case Component::FLOAT:
      return ScalarType::f32;
    case Component::DOUBLE:
      return ScalarType::f64;
    default:
      break;
  }
  throw Error(ErrorKind::data, path.string(),
              "ITK reads its voxels as " + itk::ImageIOBase::GetComponentTypeAsString(component),
              "convert them to 8, 16 or 32-bit integers, float or double");
}

Component component_type(ScalarType type) {
  switch (type) {
    case ScalarType::u8:
      return Component::UCHAR;
    case ScalarType::i8:
      return Component::CHAR;
    case ScalarType::u16:
      return Component::USHORT;
    case ScalarType::i16:
      return Component::SHORT;
    case ScalarType::u32:
      return Component::UINT;
    case ScalarType::i32:
      return Component::INT;
    case ScalarType::f32:
      return Component::FLOAT;
    case ScalarType::f64:
      break;
  }
  return Component::DOUBLE;
}

}  // namespace

Image read_header(const std::filesystem::path& path, Format format) {
  return guarded(ErrorKind::data, path, [&] {
    const auto io = make(format, path);
    io->ReadImageInformation();
    Image image;
    if (io->GetNumberOfDimensions() != 3) return image;  // as no header declares
    image.type = scalar_type(io->GetComponentType(), path);
    image.components = static_cast<int>(io->GetNumberOfComponents());
    for (unsigned axis = 0; axis < 3; ++axis) {
      image.grid.size[axis] = static_cast<std::int32_t>(io->GetDimensions(axis));
      image.grid.spacing[axis] = io->GetSpacing(axis);
      image.grid.origin[axis] = io->GetOrigin(axis);
      const std::vector<double> column = io->GetDirection(axis);
      for (unsigned row = 0; row < 3; ++row) image.grid.direction[3 * row + axis] = column.at(row);
    }
    return image;
  });
}

void write(const std::filesystem::path& path, Format format, const Image& image, bool compress) {
  guarded(ErrorKind::io, path, [&] {
    const auto io = make(format, path);
    io->SetNumberOfDimensions(3);
    itk::ImageIORegion whole(3);
    for (unsigned axis = 0; axis < 3; ++axis) {
      io->SetDimensions(axis, static_cast<itk::SizeValueType>(image.grid.size[axis]));
      io->SetSpacing(axis, image.grid.spacing[axis]);
      io->SetOrigin(axis, image.grid.origin[axis]);
      std::vector<double> column(3);
      for (unsigned row = 0; row < 3; ++row) column[row] = image.grid.direction[3 * row + axis];
      io->SetDirection(axis, column);
      whole.SetSize(axis, static_cast<itk::SizeValueType>(image.grid.size[axis]));
    }
    io->SetComponentType(component_type(image.type));
    io->SetPixelType(image.components == 1 ? itk::IOPixelEnum::SCALAR : itk::IOPixelEnum::VECTOR);
    io->SetNumberOfComponents(static_cast<unsigned>(image.components));
    io->SetUseCompression(compress);
    io->SetIORegion(whole);
    io->Write(image.bytes.data());
    return 0;
  });
}

}  // namespace ecorche::io::itk_images
