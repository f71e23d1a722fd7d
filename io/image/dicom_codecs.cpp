// SPDX-License-Identifier: Apache-2.0
// Packed frames: by OpenJPEG, which is fuzzed day and night, and by DCMTK's codecs for the rest. Debian's
// GDCM has all of them in one, and holes that are public.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmjpeg/djcparam.h>
#include <dcmtk/dcmjpeg/djdecbas.h>
#include <dcmtk/dcmjpeg/djdecext.h>
#include <dcmtk/dcmjpeg/djdeclol.h>
#include <dcmtk/dcmjpeg/djdecpro.h>
#include <dcmtk/dcmjpeg/djdecsps.h>
#include <dcmtk/dcmjpeg/djdecsv1.h>
#include <dcmtk/dcmjpeg/djrploss.h>
#include <dcmtk/dcmjpeg/djutils.h>
#include <dcmtk/dcmjpls/djcodecd.h>
#include <dcmtk/dcmjpls/djcparam.h>
#include <dcmtk/dcmjpls/djlsutil.h>
#include <openjpeg.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

#include "io/image/dicom_pixels.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io::dicom {
namespace {

using fields::refuse;
using Path = std::filesystem::path;

[[noreturn]] void broken(const Path& path, Packing packing, const std::string& what) {
  refuse(path, "its " + std::string(packing_name(packing)) + " pixels " + what,
         "copy it from the archive again");
}

struct StreamSize {
  std::uint32_t columns = 0, rows = 0, components = 0, bits = 0;
  int process = 0;  ///< of JPEG: the last byte of its start-of-frame mark
};

std::uint32_t big(std::string_view bytes, std::size_t at, std::size_t size) {
  std::uint32_t out = 0;
  for (std::size_t i = at; i < at + size; ++i) out = out << 8 | static_cast<unsigned char>(bytes[i]);
  return out;
}

// What the start of frame of a JPEG or JPEG-LS stream says; zeros where it has none.
StreamSize jpeg_size(std::string_view stream) {
  for (std::size_t at = 2; at + 10 <= stream.size();) {
    if (static_cast<unsigned char>(stream[at]) != 0xff) break;
    const int mark = static_cast<unsigned char>(stream[at + 1]);
    if (mark == 0xff) {
      ++at;
      continue;
    }
    const bool frame =
        (mark >= 0xc0 && mark <= 0xcf && mark != 0xc4 && mark != 0xc8 && mark != 0xcc) || mark == 0xf7;
    if (frame)
      return {big(stream, at + 7, 2), big(stream, at + 5, 2), big(stream, at + 9, 1), big(stream, at + 4, 1),
              mark};
    at += 2 + big(stream, at + 2, 2);
  }
  return {};
}

void check_size(const StreamSize& said, const StoredPixels& pixels, const Path& path) {
  if (said.columns == pixels.columns && said.rows == pixels.rows && said.components == 1 && said.bits > 0 &&
      said.bits <= static_cast<std::uint32_t>(pixels.allocated))
    return;
  broken(path, pixels.syntax.packing,
         "are " + std::to_string(said.columns) + " x " + std::to_string(said.rows) + " of " +
             std::to_string(said.components) + " x " + std::to_string(said.bits) + " bits, not " +
             std::to_string(pixels.columns) + " x " + std::to_string(pixels.rows) + " of " +
             std::to_string(pixels.allocated));
}

// DCMTK's codecs write what they meet on std::cerr: kept quiet, until the call is over.
class Quiet {
 public:
  Quiet() {
    for (std::size_t i = 0; i < loggers_.size(); ++i) {
      before_[i] = loggers_[i]->getLogLevel();
      loggers_[i]->setLogLevel(OFLogger::OFF_LOG_LEVEL);
    }
  }
  ~Quiet() {
    for (std::size_t i = 0; i < loggers_.size(); ++i) loggers_[i]->setLogLevel(before_[i]);
  }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  std::array<OFLogger*, 3> loggers_{&DCM_dcmdataLogger, &DCM_dcmjpegLogger, &DCM_dcmjplsLogger};
  std::array<dcmtk::log4cplus::LogLevel, 3> before_{};
};

// What DCMTK's codecs ask of the data set.
void describe(DcmDataset& set, const StoredPixels& pixels) {
  set.putAndInsertUint16(DCM_SamplesPerPixel, 1);
  set.putAndInsertString(DCM_PhotometricInterpretation, "MONOCHROME2");
  set.putAndInsertUint16(DCM_Rows, static_cast<Uint16>(pixels.rows));
  set.putAndInsertUint16(DCM_Columns, static_cast<Uint16>(pixels.columns));
  set.putAndInsertUint16(DCM_BitsAllocated, static_cast<Uint16>(pixels.allocated));
  set.putAndInsertUint16(DCM_BitsStored, static_cast<Uint16>(pixels.stored));
  set.putAndInsertUint16(DCM_HighBit, static_cast<Uint16>(pixels.high));
  set.putAndInsertUint16(DCM_PixelRepresentation, pixels.is_signed ? 1 : 0);
  set.putAndInsertString(DCM_NumberOfFrames, "1");
}

void decode(const DcmCodec& codec, const DcmCodecParameter& parameter, std::string_view packed,
            const StoredPixels& pixels, std::span<std::byte> out, const Path& path) {
  const Quiet quiet;
  DcmDataset set;
  describe(set, pixels);
  DcmPixelSequence sequence(DcmTag(DCM_PixelData, EVR_OB));
  sequence.insert(new DcmPixelItem(DcmTag(DCM_PixelItemTag, EVR_OB)));  // owned by the sequence
  auto stream = std::make_unique<DcmPixelItem>(DcmTag(DCM_PixelItemTag, EVR_OB));
  std::string even(packed);
  if (even.size() % 2 != 0) even += '\0';
  if (stream
          ->putUint8Array(reinterpret_cast<const Uint8*>(even.data()),
                          static_cast<unsigned long>(even.size()))
          .bad() ||
      sequence.insert(stream.get()).bad())
    broken(path, pixels.syntax.packing, "are too long");
  (void)stream.release();
  Uint32 fragment = 1;
  OFString colours;
  const OFCondition done = codec.decodeFrame(nullptr, &sequence, &parameter, &set, 0, fragment, out.data(),
                                             static_cast<Uint32>(out.size()), colours);
  if (done.bad()) broken(path, pixels.syntax.packing, std::string("cannot be unpacked: ") + done.text());
}

void unpack_jpeg(std::string_view packed, const StoredPixels& pixels, std::span<std::byte> out,
                 const Path& path) {
  const DJCodecParameter parameter(ECC_lossyYCbCr, EDC_never, EUC_never, EPC_default, OFTrue);
  const StreamSize said = jpeg_size(packed);
  check_size(said, pixels, path);
  // By the process of the stream itself: programs write the wrong transfer syntax.
  std::unique_ptr<DJCodecDecoder> codec;
  switch (said.process) {
    case 0xc0:
      codec = std::make_unique<DJDecoderBaseline>();
      break;
    case 0xc1:
      codec = std::make_unique<DJDecoderExtended>();
      break;
    case 0xc2:
      codec = std::make_unique<DJDecoderProgressive>();
      break;
    case 0xc3:
      codec = std::make_unique<DJDecoderLossless>();
      break;
    default:
      broken(path, pixels.syntax.packing, "are of a kind of JPEG that nobody writes");
  }
  decode(*codec, parameter, packed, pixels, out, path);
}

struct ReadStream {
  std::string_view bytes;
  std::size_t at = 0;
};

OPJ_SIZE_T read_some(void* into, OPJ_SIZE_T size, void* user) {
  auto& stream = *static_cast<ReadStream*>(user);
  const std::size_t taken = std::min<std::size_t>(size, stream.bytes.size() - stream.at);
  if (taken == 0) return static_cast<OPJ_SIZE_T>(-1);
  std::memcpy(into, stream.bytes.data() + stream.at, taken);
  stream.at += taken;
  return taken;
}

OPJ_OFF_T skip_some(OPJ_OFF_T size, void* user) {
  auto& stream = *static_cast<ReadStream*>(user);
  if (size < 0 || static_cast<std::size_t>(size) > stream.bytes.size() - stream.at) return -1;
  stream.at += static_cast<std::size_t>(size);
  return size;
}

OPJ_BOOL seek_to(OPJ_OFF_T where, void* user) {
  auto& stream = *static_cast<ReadStream*>(user);
  if (where < 0 || static_cast<std::size_t>(where) > stream.bytes.size()) return OPJ_FALSE;
  stream.at = static_cast<std::size_t>(where);
  return OPJ_TRUE;
}

// SIZ is the first mark of a stream (ISO 15444-1 A.5.1). Few tiles: each costs OpenJPEG kilobytes.
void check_siz(std::string_view stream, const StoredPixels& pixels, const Path& path) {
  if (stream.size() < 47 || big(stream, 0, 4) != 0xff4fff51)
    broken(path, pixels.syntax.packing, "do not begin as a JPEG 2000 stream");
  const std::uint32_t x1 = big(stream, 8, 4), y1 = big(stream, 12, 4), x0 = big(stream, 16, 4),
                      y0 = big(stream, 20, 4);
  const std::uint64_t wide = std::max<std::uint32_t>(big(stream, 24, 4), 1),
                      high = std::max<std::uint32_t>(big(stream, 28, 4), 1);
  check_size({x1 - x0, y1 - y0, big(stream, 40, 2), (big(stream, 42, 1) & 0x7f) + 1, 0}, pixels, path);
  if ((x1 / wide + 1) * (y1 / high + 1) > 4096) broken(path, pixels.syntax.packing, "lie in too many tiles");
}

template <class T>
void store(const opj_image_comp_t& component, std::span<std::byte> out) {
  const std::span<T> to(reinterpret_cast<T*>(out.data()), out.size() / sizeof(T));
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = static_cast<T>(component.data[i]);
}

void unpack_jpeg_2000(std::string_view packed, const StoredPixels& pixels, std::span<std::byte> out,
                      const Path& path) {
  check_siz(packed, pixels, path);
  ReadStream from{packed};
  const std::unique_ptr<opj_stream_t, decltype(&opj_stream_destroy)> stream(
      opj_stream_create(std::max<std::size_t>(packed.size(), 64), OPJ_TRUE), &opj_stream_destroy);
  opj_stream_set_read_function(stream.get(), read_some);
  opj_stream_set_skip_function(stream.get(), skip_some);
  opj_stream_set_seek_function(stream.get(), seek_to);
  opj_stream_set_user_data(stream.get(), &from, nullptr);
  opj_stream_set_user_data_length(stream.get(), packed.size());
  const std::unique_ptr<opj_codec_t, decltype(&opj_destroy_codec)> codec(opj_create_decompress(OPJ_CODEC_J2K),
                                                                         &opj_destroy_codec);
  opj_dparameters_t parameters{};
  opj_set_default_decoder_parameters(&parameters);
  opj_image_t* made = nullptr;
  const bool head = opj_setup_decoder(codec.get(), &parameters) != 0 &&
                    opj_read_header(stream.get(), codec.get(), &made) != 0;
  const std::unique_ptr<opj_image_t, decltype(&opj_image_destroy)> image(made, &opj_image_destroy);
  if (!head || opj_decode(codec.get(), stream.get(), image.get()) == 0 || image->numcomps != 1 ||
      image->comps[0].data == nullptr || image->comps[0].w != pixels.columns ||
      image->comps[0].h != pixels.rows)
    broken(path, pixels.syntax.packing, "cannot be unpacked");
  if (pixels.allocated == 8) {
    store<std::uint8_t>(image->comps[0], out);
  } else if (pixels.allocated == 16) {
    store<std::uint16_t>(image->comps[0], out);
  } else {
    store<std::uint32_t>(image->comps[0], out);
  }
}

}  // namespace

void unpack(std::string_view packed, const StoredPixels& pixels, std::span<std::byte> out, const Path& path) {
  switch (pixels.syntax.packing) {
    case Packing::rle:
      return unpack_rle(packed, pixels, out, path);
    case Packing::jpeg_ls: {
      check_size(jpeg_size(packed), pixels, path);
      const DJLSNearLosslessDecoder codec;
      return decode(codec, DJLSCodecParameter(), packed, pixels, out, path);
    }
    case Packing::jpeg_2000:
      return unpack_jpeg_2000(packed, pixels, out, path);
    default:
      return unpack_jpeg(packed, pixels, out, path);
  }
}

}  // namespace ecorche::io::dicom
