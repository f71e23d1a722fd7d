// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <string>

#include "io/image/equal_run.hpp"
#include "io/image/header.hpp"
#include "io/image/image_file.hpp"
#include "io/image/packed_nifti.hpp"
#include "io/image/packed_nrrd.hpp"
#include "tests/unit/io/itk_reading.hpp"
#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

// An oblique left-handed grid: third axis reversed, then turned about z.
ImageGrid oblique_grid() {
  ImageGrid grid;
  grid.size = {5, 4, 3};
  grid.origin = {-12.5, 30.25, 7.125};
  grid.spacing = {0.5, 0.75, 2.5};
  const double c = std::cos(0.3), s = std::sin(0.3);
  grid.direction = {c, -s, 0, s, c, 0, 0, 0, -1};
  return grid;
}

Image noise(ScalarType type, int components) {
  Image image(oblique_grid(), type, components);
  std::mt19937 random(7);
  with_scalar_type(type, [&](auto t) {
    for (auto& x : image.scalars<decltype(t)>())
      x = static_cast<decltype(t)>(static_cast<int>(random() % 90));
  });
  return image;
}

void expect_same_grid(const ImageGrid& a, const ImageGrid& b, double tolerance) {
  EXPECT_EQ(a.size, b.size);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(a.spacing[i], b.spacing[i], tolerance);
    EXPECT_NEAR(a.origin[i], b.origin[i], tolerance);
  }
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(a.direction[i], b.direction[i], tolerance);
}

void expect_same(const Image& a, const Image& b, double tolerance) {
  expect_same_grid(a.grid, b.grid, tolerance);
  EXPECT_EQ(scalar_name(a.type), scalar_name(b.type));
  EXPECT_EQ(a.components, b.components);
  EXPECT_EQ(a.bytes, b.bytes);
}

const std::string kNrrd =
    "NRRD0004\n# made by hand\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 3 "
    "4\n"
    "space directions: (1,0,0) (0,2,0) (0,0,3)\nkinds: domain domain domain\nencoding: raw\nspace origin: "
    "(5,6,7)\n\n" +
    std::string(24, 'a');
const std::string kMeta =
    "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = "
    "False\n"
    "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 5 6 7\nElementSpacing = 1 2 3\nDimSize = 2 3 "
    "4\nElementType = MET_UCHAR\n"
    "ElementDataFile = LOCAL\n" +
    std::string(24, 'a');

std::string changed(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, text.npos) << from;
  return at == text.npos ? text : text.replace(at, from.size(), to);
}

TEST(Image, EveryTypeComesBackWhole) {
  const Scratch scratch;
  for (const char* name : {"a.nrrd", "a.mha"}) {
    for (int type = 0; type <= static_cast<int>(ScalarType::f64); ++type) {
      for (const int components : {1, 3}) {
        const Image image = noise(static_cast<ScalarType>(type), components);
        write_image(scratch / name, image, components == 1);
        SCOPED_TRACE(std::string(name) + " " + std::string(scalar_name(image.type)) + " x " +
                     std::to_string(components));
        expect_same(read_image(scratch / name), image, 1e-12);
      }
    }
  }
}

TEST(Image, HandMadeHeadersAreReadInLps) {
  const Scratch scratch;
  const Image lps = read_image(scratch.put("a.nrrd", kNrrd));
  expect_same(read_image(scratch.put("a.mha", kMeta)), lps, 1e-12);
  EXPECT_EQ(lps.grid.size, (std::array<std::int32_t, 3>{2, 3, 4}));
  EXPECT_EQ(lps.grid.point(1, 1, 1), (std::array<double, 3>{6, 8, 10}));
  // Right, anterior, superior: x and y turn round.
  const Image ras =
      read_image(scratch.put("r.nrrd", changed(kNrrd, "left-posterior-superior", "right-anterior-superior")));
  EXPECT_EQ(ras.grid.point(1, 1, 1), (std::array<double, 3>{-6, -8, 10}));
}

TEST(Image, ItkReadsDisplacementsInLps) {
  const Scratch scratch;
  Image image(oblique_grid(), ScalarType::f32, 3);
  for (std::size_t i = 0; i < image.scalars<float>().size(); ++i)
    image.scalars<float>()[i] = static_cast<float>(i) / 8;
  const std::size_t voxel = image.grid.offset(3, 2, 1);
  const auto expected = image.grid.point(3, 2, 1);
  for (const char* name : {"a.nrrd", "a.mha", "a.nii.gz"}) {
    write_image(scratch / name, image);
    const auto seen = foreign::itk_displacement(scratch / name, {3, 2, 1});
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(seen.vector[k], static_cast<double>(image.scalars<float>()[3 * voxel + k])) << name;
      EXPECT_NEAR(seen.probed[k], seen.vector[k], 1e-4) << name;
      EXPECT_NEAR(seen.point[k], expected[k], 1e-5) << name;
    }
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 3);  // no temporaries
}

TEST(Image, EveryPrefixIsRefused) {
  const Scratch scratch;
  write_image(scratch / "z.nrrd", noise(ScalarType::i16, 1));
  write_image(scratch / "z.mha", noise(ScalarType::i16, 1));
  for (const auto& [name, whole] : {std::pair<std::string, std::string>{"a.nrrd", kNrrd},
                                    {"a.mha", kMeta},
                                    {"b.nrrd", scratch.get("z.nrrd")},
                                    {"b.mha", scratch.get("z.mha")}}) {
    EXPECT_NO_THROW(read_image(scratch.put(name, whole))) << name;
    for (std::size_t n = 0; n < whole.size(); n += n + 30 < whole.size() ? 5 : 1) {
      EXPECT_THROW(read_image(scratch.put(name, whole.substr(0, n))), Error) << name << " " << n;
    }
  }
}

TEST(Image, FlippedBytesNeverHarm) {
  const Scratch scratch;
  write_image(scratch / "z.nrrd", noise(ScalarType::u8, 1));
  write_image(scratch / "z.mha", noise(ScalarType::u8, 1));
  // Two volumes in time, of which the second is read.
  std::string nrrd = changed(kNrrd, "dimension: 3", "dimension: 4");
  nrrd = changed(changed(nrrd, "sizes: 2 3 4", "sizes: 2 3 4 2"), "(0,0,3)", "(0,0,3) none");
  scratch.put("t.nrrd", changed(nrrd, "kinds: domain domain domain\n", "") + std::string(24, 'b'));
  std::string meta = changed(changed(kMeta, "NDims = 3", "NDims = 4"), "= 2 3 4", "= 2 3 4 2");
  meta = changed(changed(meta, "1 0 0 0 1 0 0 0 1", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"), "5 6 7", "5 6 7 0");
  scratch.put("t.mha", changed(meta, "= 1 2 3", "= 1 2 3 1") + std::string(24, 'b'));
  ImageChoice second;
  second.phase = 2;
  EXPECT_EQ(read_image(scratch / "t.nrrd", {}, second).bytes, std::vector<std::byte>(24, std::byte{'b'}));
  expect_same(read_image(scratch / "t.mha", {}, second), read_image(scratch / "t.nrrd", {}, second), 0);
  std::mt19937 random(1);
  for (const std::string name : {"z.nrrd", "z.mha", "t.nrrd", "t.mha"}) {
    const std::string whole = scratch.get(name);
    int read = 0;
    for (int round = 0; round < 150; ++round) {
      std::string bytes = whole;
      bytes[random() % bytes.size()] = static_cast<char>(random());
      const auto path = scratch.put("a" + name, bytes);
      try {
        const Image image = read_image(path, {}, name[0] == 't' ? second : ImageChoice{});
        ASSERT_EQ(image.bytes.size(), image.grid.voxels() * static_cast<std::size_t>(image.components) *
                                          scalar_bytes(image.type));
        ++read;
      } catch (const Error& error) {
        ASSERT_NE(static_cast<int>(error.kind()), static_cast<int>(ErrorKind::internal)) << error.what();
      }
    }
    EXPECT_GT(read, 5) << name;
  }
}

TEST(Image, EveryMistakeInANrrdIsNamed) {
  const Scratch scratch;
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& part,
                           ErrorKind kind = ErrorKind::data) {
    const auto path = scratch.put("ct.nrrd", changed(kNrrd, from, to));
    expect_error(kind, part, [&] { read_image(path); });
  };
  refused("NRRD0004", "NRRD0009", "ct.nrrd: is no NRRD: its first line is not NRRD0001 to NRRD0005");
  refused("dimension: 3", "dimension: 2", "ct.nrrd: has 2 axes (save a 3-D image)");
  refused("dimension: 3", "dimension: 4",
          "has 4 axes, and neither the first nor the last is the only one with space direction 'none'");
  refused("sizes: 2 3 4", "sizes: 2 3", "its sizes are '2 3'");
  refused("sizes: 2 3 4", "seizes: 2 3 4", "its header lacks 'sizes'");
  refused("sizes: 2 3 4", "sizes 2 3 4", "line 6 of its header is no field: 'sizes 2 3 4'");
  expect_error(ErrorKind::data, "ct.nrrd: its header does not end",
               [&] { read_image(scratch.put("ct.nrrd", kNrrd.substr(0, kNrrd.find("\n\n") + 1))); });
  refused("sizes: 2 3 4", "sizes: 2 -3 4", "sizes is '-3' (it must be a whole number from 1 to 2147483647)");
  refused("sizes: 2 3 4", "sizes: 2147483647 2147483647 2147483647",
          "declares 2147483647 x 2147483647 x 2147483647 voxels of 1 u8 (images may hold 2^33 bytes");
  refused("sizes: 2 3 4", "sizes: 2048 2048 2048", "declares 8589934592 bytes of voxels, but has 24");
  refused("sizes: 2 3 4", "sizes: 2 3 5", "declares 30 bytes of voxels, but has 24");
  refused("sizes: 2 3 4", "sizes: 2 3 3", "declares 18 bytes of voxels, but has 24");
  refused("type: unsigned char", "type: block", "voxels of type 'block' cannot be read");
  refused("type: unsigned char", "type: int64", "declares 192 bytes of voxels, but has 24");
  refused("type: unsigned char", "type: int128", "voxels of type 'int128' cannot be read");
  refused("encoding: raw", "encoding: bzip2", "its encoding is 'bzip2' (save it as raw or gzip)");
  refused("encoding: raw", "encoding: gzip", "compressed voxels are damaged");
  refused("encoding: raw", "encoding: raw\nencoding: raw", "its header gives 'encoding' twice");
  refused("encoding: raw", "encoding: raw\nbyte skip: 4", "declares 24 bytes of voxels, but has 20");
  refused("encoding: raw", "data file: ../other.raw\nencoding: raw", "its voxels are in '../other.raw'");
  refused("encoding: raw", "data file: /etc/passwd\nencoding: raw", "its voxels are in '/etc/passwd'");
  refused("encoding: raw", "data file: LIST\nencoding: raw", "its voxels are in 'LIST'");
  refused("encoding: raw", "data file: slice%03d.raw 1 9 1\nencoding: raw",
          "its voxels are in 'slice%03d.raw 1 9 1'");
  refused("encoding: raw", "data file: none.raw\nencoding: raw", "none.raw: cannot be opened (the header ",
          ErrorKind::missing_input);
  refused("encoding: raw", "space units: \"m\" \"m\" \"m\"\nencoding: raw", "its space units are");
  refused("(1,0,0)", "(1,2,0)", "its axes are not orthonormal");
  refused("(1,0,0)", "(nan,0,0)", "ct.nrrd");
  refused("(1,0,0)", "(0,0,0)", "ct.nrrd");
  refused("(5,6,7)", "(5,6,1e300)", "its origin is");
  expect_error(ErrorKind::data, "'.tif' images cannot be read (convert it to .nrrd, .mha or .nii.gz)",
               [&] { read_image(scratch.put("a.tif", "x")); });
  expect_error(ErrorKind::missing_input, "none.nrrd: cannot be opened",
               [&] { read_image(scratch / "none.nrrd"); });
}

TEST(Image, EveryMistakeInAMetaImageIsNamed) {
  const Scratch scratch;
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& part,
                           ErrorKind kind = ErrorKind::data) {
    const auto path = scratch.put("ct.mha", changed(kMeta, from, to));
    expect_error(kind, part, [&] { read_image(path); });
  };
  refused("ObjectType = Image", "ObjectType = Tube", "ct.mha: holds a 'Tube' (it must be an image)");
  refused("ObjectType = Image", "hello", "line 1 of its header is no 'Key = value': 'hello'");
  refused("NDims = 3", "NDims = 2", "ct.mha: has 2 axes (save a 3-D image)");
  refused("NDims = 3", "NDimes = 3", "its header lacks 'NDims'");
  refused("DimSize = 2 3 4", "DimSize = 2 3 2147483647",
          "declares 2 x 3 x 2147483647 voxels of 1 u8 (images may hold 2^33 bytes");
  refused("DimSize = 2 3 4", "DimSize = 2 3 99999999999", "DimSize is '99999999999'");
  refused("DimSize = 2 3 4", "DimSize = 2 3 3", "declares 18 bytes of voxels, but has 24");
  refused("DimSize = 2 3 4", "DimSize = 2 3 4\nDimSize = 2 3 4", "its header gives 'DimSize' twice");
  refused("MET_UCHAR", "MET_LONG", "voxels of type 'MET_LONG' cannot be read");
  refused("BinaryData = True", "BinaryData = False", "its voxels are text");
  refused("ElementSpacing = 1 2 3", "ElementSpacing = 1 -2 3", "ct.mha: ");
  refused("TransformMatrix = 1 0 0", "TransformMatrix = 1 1 0", "its axes are not orthonormal");
  refused("NDims = 3", "NDims = 3\nHeaderSize = -1", "its header asks to skip -1 bytes of its own file");
  refused("= LOCAL", "= a/b.raw", "its voxels are in 'a/b.raw' (put them in one file beside the header");
  refused("= LOCAL", "= LIST", "its voxels are in 'LIST'");
  refused("CompressedData = False", "CompressedData = True\nCompressedDataSize = 25",
          "declares 25 compressed bytes, but has 24");
  refused("CompressedData = False", "CompressedData = True", "compressed voxels are damaged");
}

// A stream that inflates to far more than its header says, and a header that says more than a stream can
// hold.
TEST(Image, GzipBombsAreRefusedBeforeTheyInflate) {
  const Scratch scratch;
  ImageGrid grid;
  grid.size = {1024, 1024, 32};
  write_image(scratch / "zeros.nrrd", Image(grid, ScalarType::u8));
  const std::string bomb = scratch.get("zeros.nrrd");
  ASSERT_LT(bomb.size(), 200000u);
  const auto refused = [&](const std::string& sizes, const std::string& part) {
    const auto path = scratch.put("bomb.nrrd", changed(bomb, "sizes: 1024 1024 32", sizes));
    expect_error(ErrorKind::data, part, [&] { read_image(path); });
  };
  refused("sizes: 2 3 4", "declares 24 bytes of voxels, but its compressed data hold more");
  refused("sizes: 1024 1024 33", "declares 34603008 bytes of voxels, but its compressed data hold 33554432");
  refused("sizes: 2048 2048 2048", "compressed bytes cannot hold them");
}

TEST(Image, DetachedVoxelsBesideTheHeader) {
  const Scratch scratch;
  const std::size_t raw = kNrrd.size() - 24;
  scratch.put("voxels.raw", kNrrd.substr(raw));
  const Image whole = read_image(scratch.put("a.nrrd", kNrrd));
  const std::string header =
      changed(kNrrd.substr(0, raw), "encoding: raw", "data file: voxels.raw\nencoding: raw");
  expect_same(read_image(scratch.put("a.nhdr", header)), whole, 0);
  const std::string meta = changed(kMeta.substr(0, kMeta.size() - 24), "LOCAL", "voxels.raw");
  expect_same(read_image(scratch.put("a.mhd", meta)), whole, 0);
}

// As if the file had become shorter since it was checked.
TEST(Image, VoxelsThatAreGoneAreNamed) {
  const Scratch scratch;
  ImageHeader header;
  header.size = {2, 3, 4};
  header.data_file = scratch.put("a.raw", "less");
  expect_error(ErrorKind::io, "a.raw: reading failed (check the disk)",
               [&] { stored_voxels(header, "a.nhdr"); });
}

// Pieces are packed beside each other: what lies over their ends comes back, noise and runs.
TEST(Image, PackedInPieces) {
  const Scratch scratch;
  ImageGrid grid;
  grid.size = {301, 257, 29};
  Image image(grid, ScalarType::i16);
  std::uint32_t state = 1;
  for (std::int16_t& v : image.scalars<std::int16_t>()) {
    state = state * 1664525 + 1013904223;
    v = state >> 31 != 0 ? static_cast<std::int16_t>(state >> 16) : std::int16_t{7};
  }
  write_image(scratch / "a.nrrd", image);
  expect_same(read_image(scratch / "a.nrrd"), image, 0);
  expect_error(ErrorKind::io, "/dev/full: writing failed (check the disk's free space)",
               [&] { write_packed_nrrd("/dev/full", image); });
}

std::string unpacked(const std::filesystem::path& path) {
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose);
  std::string out(std::size_t{1} << 25, '\0');
  const int read = gzread(file.get(), out.data(), static_cast<unsigned>(out.size()));
  out.resize(read < 0 ? 0 : static_cast<std::size_t>(read));
  return out;
}

// ITK writes the plain file: the packed one is the same, header and vectors and all, over the ends of pieces.
TEST(Image, PackedNiftiIsThePlainOne) {
  const Scratch scratch;
  for (const auto& size : {std::array<std::int32_t, 3>{5, 4, 3}, {128, 96, 50}, {5, 1, 3}, {5, 4, 1}}) {
    for (const ScalarType type : {ScalarType::u8, ScalarType::i16, ScalarType::f32, ScalarType::f64}) {
      for (const int components : {1, 3}) {
        ImageGrid grid = oblique_grid();
        grid.size = size;
        Image image(grid, type, components);
        std::mt19937 random(7);
        for (std::byte& byte : image.bytes) byte = static_cast<std::byte>(random() % 120);
        write_image(scratch / "plain.nii", image);
        write_image(scratch / "packed.nii.gz", image);
        ASSERT_EQ(unpacked(scratch / "packed.nii.gz"), unpacked(scratch / "plain.nii"))
            << size[0] << " " << size[2] << " " << scalar_name(type) << " x " << components;
      }
    }
  }
  std::filesystem::create_symlink("/dev/full", scratch / "full.nii.gz");
  expect_error(ErrorKind::io, "full.nii.gz: writing failed (check the disk's free space)",
               [&] { write_packed_nifti(scratch / "full.nii.gz", Image(oblique_grid(), ScalarType::u8)); });
}

// A run by bytes, wherever it begins and ends, beside one looked at value by value.
template <class T>
void runs_end_where_values_change(const std::vector<T>& values) {
  const auto same = [](const T& a, const T& b) {
    return std::ranges::equal(std::as_bytes(std::span(&a, 1)), std::as_bytes(std::span(&b, 1)));
  };
  std::uint32_t state = 3;
  std::vector<T> row;
  while (row.size() < 500) {
    state = state * 1664525 + 1013904223;
    row.insert(row.end(), 1 + (state >> 24) % 21, values[(state >> 8) % values.size()]);
  }
  for (std::size_t begin = 0; begin < row.size(); ++begin) {
    std::size_t end = begin + 1;
    while (end < row.size() && same(row[end], row[begin])) ++end;
    EXPECT_EQ(end_of_run(row.data() + begin, row.data() + row.size()) - row.data(),
              static_cast<std::ptrdiff_t>(end));
  }
}

TEST(Image, RunsEndWhereValuesChange) {
  runs_end_where_values_change<std::uint8_t>({0, 1, 255});
  runs_end_where_values_change<std::int16_t>({0, -1, 256});
  runs_end_where_values_change<std::uint32_t>({0, 1, 1U << 31U});
  runs_end_where_values_change<float>({0.0F, -0.0F, 1.5F, std::numeric_limits<float>::quiet_NaN()});
  runs_end_where_values_change<double>({0.0, -0.0, 1.5, std::numeric_limits<double>::quiet_NaN()});
}

TEST(Image, WritingRefusesWhatItCannotDo) {
  const Scratch scratch;
  Image image = noise(ScalarType::u8, 1);
  expect_error(ErrorKind::usage, "cannot write '.png' images (use .nrrd, .mha or .nii.gz)",
               [&] { write_image(scratch / "a.png", image); });
  expect_error(ErrorKind::cannot_create, "a.nrrd", [&] { write_image(scratch / "none" / "a.nrrd", image); });
  image.bytes.pop_back();
  expect_error(ErrorKind::internal, "the image has 59 bytes, its grid takes 60",
               [&] { write_image(scratch / "a.nrrd", image); });
  EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

}  // namespace
}  // namespace ecorche::io
