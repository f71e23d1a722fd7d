// SPDX-License-Identifier: Apache-2.0
#include "io/case/digest.hpp"

#include <xxhash.h>

#include <fstream>
#include <memory>
#include <new>
#include <vector>

namespace ecorche::io {

std::uint64_t file_digest(const std::filesystem::path& path, const Context& context) {
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw Error(ErrorKind::missing_input, path.string(), "cannot be opened", "check the path and its rights");
  const std::unique_ptr<XXH64_state_t, XXH_errorcode (*)(XXH64_state_t*)> state(XXH64_createState(),
                                                                                XXH64_freeState);
  if (!state) throw std::bad_alloc();
  XXH64_reset(state.get(), 0);
  std::vector<char> block(std::size_t{1} << 20);
  while (file.read(block.data(), static_cast<std::streamsize>(block.size())) || file.gcount() > 0) {
    context.check_stop();
    XXH64_update(state.get(), block.data(), static_cast<std::size_t>(file.gcount()));
  }
  if (file.bad()) throw Error(ErrorKind::io, path.string(), "reading failed", "check the disk");
  return XXH64_digest(state.get());
}

}  // namespace ecorche::io
