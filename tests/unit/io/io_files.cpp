// SPDX-License-Identifier: Apache-2.0
// What the Python tests drive: our readers and writers as a little command.
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/values/error.hpp"
#include "io/image/image_file.hpp"
#include "io/image/segmentation.hpp"

namespace ecorche::io {
namespace {

// The grid as JSON on stdout, the voxels as they lie in memory into a file.
void describe(const char* path, const char* raw) {
  const Image image = read_image(path);
  std::ofstream(raw, std::ios::binary)
      .write(reinterpret_cast<const char*>(image.bytes.data()),
             static_cast<std::streamsize>(image.bytes.size()));
  const nlohmann::json out{{"size", image.grid.size},        {"type", scalar_name(image.type)},
                           {"components", image.components}, {"origin", image.grid.point(0, 0, 0)},
                           {"i", image.grid.point(1, 0, 0)}, {"j", image.grid.point(0, 1, 0)},
                           {"k", image.grid.point(0, 0, 1)}};
  std::printf("%s\n", out.dump().c_str());
}

int run(int argc, char** argv) {
  const std::string what = argc > 3 ? argv[1] : "";
  if (what == "describe") {
    describe(argv[2], argv[3]);
  } else if (what == "copy") {
    write_image(argv[3], read_image(argv[2]));
  } else {
    std::fprintf(stderr, "usage: io_files describe IMAGE RAW | copy IMAGE IMAGE\n");
    return 64;
  }
  return 0;
}

}  // namespace
}  // namespace ecorche::io

int main(int argc, char** argv) {
  try {
    return ecorche::io::run(argc, argv);
  } catch (const ecorche::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return ecorche::exit_code(error.kind());
  }
}
