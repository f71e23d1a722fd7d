// SPDX-License-Identifier: Apache-2.0
#include "app/tokens_file.hpp"

#include <set>

#include "io/case/yaml_reader.hpp"

namespace ecorche::app {
namespace {

using io::yaml::Value;

constexpr std::int64_t kMostConnections = 65536;
constexpr double kMostMessages = 1e6;

server::TokenDigest read_digest(const Value& value) {
  const auto digest = server::digest_from_hex(value.text());
  if (!digest)
    value.fail("is no SHA-256 of 64 hexadecimal digits", "write what printf %s TOKEN | sha256sum prints");
  return *digest;
}

server::Right read_role(const Value& value) {
  const auto right = server::right_from_name(value.text());
  const std::vector<std::string> known{"watch", "pose", "manage"};
  if (!right) value.fail_unknown("role", value.text(), known);
  return *right;
}

server::Pass read_pass(const Value& row) {
  row.allow(std::vector<std::string_view>{"name", "sha256", "role", "max_connections", "message_rate"});
  server::Pass pass{.name = row.at("name").identifier(),
                    .digest = read_digest(row.at("sha256")),
                    .right = read_role(row.at("role"))};
  if (const auto most = row.find("max_connections")) {
    const std::int64_t count = most->integer();
    if (count < 1 || count > kMostConnections)
      most->fail(most->text() + " is not 1 to 65536", "give so many");
    pass.connections = static_cast<std::uint32_t>(count);
  }
  if (const auto rate = row.find("message_rate")) {
    const double number = rate->number();
    if (number < 1 || number > kMostMessages) rate->fail(rate->text() + " is not 1 to 1e6", "give so many");
    pass.messages_per_second = number;
  }
  return pass;
}

}  // namespace

std::vector<server::Pass> read_tokens(const std::string& path) {
  const Value file = Value::read(path);
  file.allow(std::vector<std::string_view>{"ecorche_tokens", "tokens"});
  if (const Value version = file.at("ecorche_tokens"); version.integer() != 1)
    version.fail("version " + version.text() + " is unknown", "write ecorche_tokens: 1");
  const Value list = file.at("tokens");
  std::vector<server::Pass> passes;
  std::set<std::string> names;
  std::set<server::TokenDigest> digests;
  for (const Value& row : list.items()) {
    server::Pass pass = read_pass(row);
    if (!names.insert(pass.name).second) row.at("name").fail("two tokens have this name", "rename one");
    if (!digests.insert(pass.digest).second)
      row.at("sha256").fail("two tokens have this digest", "make one anew, by openssl rand -hex 32");
    passes.push_back(std::move(pass));
  }
  if (passes.empty()) list.fail("no token is there", "list one at least, or serve without --tokens");
  return passes;
}

}  // namespace ecorche::app
