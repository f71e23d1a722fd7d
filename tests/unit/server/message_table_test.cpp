// SPDX-License-Identifier: Apache-2.0
// What each message needs: as envelope.proto and docs/reference/protocol.md say, and as a client hears it.
#include "runtime/server/handlers/message_table.hpp"

#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include "tests/unit/server/client_stage.hpp"

namespace ecorche::server {
namespace {

std::string text_of(const char* path) {
  std::ifstream file(path);
  EXPECT_TRUE(file) << path;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

// Names of the oneof's messages by their numbers, by the comment above each group of them.
std::map<std::string, std::map<int, std::string>> envelope_messages() {
  const std::string text = text_of(ECORCHE_ENVELOPE);
  std::istringstream lines(text.substr(text.find("oneof message")));
  const std::regex comment("    // (.*)"), field(R"(    (\w+) \w+ = (\d+);)");
  std::map<std::string, std::map<int, std::string>> groups;
  std::string group;
  std::smatch match;
  for (std::string line; std::getline(lines, line);) {
    if (std::regex_match(line, match, comment)) group = match[1];
    if (std::regex_match(line, match, field)) groups[group][std::stoi(match[2])] = match[1];
  }
  return groups;
}

std::map<int, std::string> messages_to_server() {
  auto groups = envelope_messages();
  std::map<int, std::string> out = groups["To the server."];
  out.merge(groups["Either way."]);
  return out;
}

// An envelope with this message, of which nothing is set.
v1::Envelope empty_message(int number) {
  std::string bytes;
  const unsigned tag = (static_cast<unsigned>(number) << 3U) | 2U;
  if (tag >= 128) bytes.push_back(static_cast<char>((tag & 127U) | 128U));
  bytes.push_back(static_cast<char>(tag >= 128 ? tag >> 7U : tag));
  bytes.push_back('\0');
  v1::Envelope envelope;
  EXPECT_TRUE(envelope.ParseFromString(bytes));
  EXPECT_EQ(static_cast<int>(envelope.message_case()), number);
  envelope.set_request_id(7);
  return envelope;
}

// How the client hears that it was refused; ok where it does not.
Status refusal(const MessageRow& row, const std::optional<v1::Envelope>& answer) {
  if (!answer) return {};
  if (row.refusal == Refusal::pose_ack) {
    EXPECT_EQ(answer->request_id(), 0U);
    return wire::from_proto(answer->pose_ack().status());
  }
  if (!answer->has_status()) return {};
  EXPECT_EQ(answer->request_id(), row.refusal == Refusal::end ? 0U : 7U);
  return wire::from_proto(answer->status());
}

TEST(MessageTable, HasARowForEachMessageToTheServerAndNoOther) {
  const std::map<int, std::string> messages = messages_to_server();
  EXPECT_GE(messages.size(), 20U);
  for (const auto& [number, name] : messages)
    EXPECT_TRUE(find_message(static_cast<v1::Envelope::MessageCase>(number))) << name;
  EXPECT_EQ(message_table().size(), messages.size());
  for (const auto& [group, others] : envelope_messages()) {
    if (group == "To the server." || group == "Either way.") continue;
    for (const auto& [number, name] : others)
      EXPECT_FALSE(find_message(static_cast<v1::Envelope::MessageCase>(number))) << name;
  }
}

TEST(MessageTable, SaysWhatTheProtocolsPageSays) {
  const std::string page = text_of(ECORCHE_PROTOCOL_PAGE);
  const std::string heading = "## What a message needs\n";
  const std::size_t begin = page.find(heading);
  ASSERT_NE(begin, std::string::npos);
  std::istringstream lines(page.substr(begin, page.find("\n## ", begin) - begin));
  std::string expected, found;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("| `", 0) == 0) found += line + "\n";
  }
  const std::map<int, std::string> names = messages_to_server();
  for (const MessageRow& row : message_table()) {
    std::string needs = row.needs.hello ? "hello" : "nothing: it comes first, and once";
    if (row.needs.right != Right::watch)
      needs += std::string(", the right to ") + right_name(row.needs.right);
    if (row.needs.model) needs += ", model";
    if (row.needs.control == Needs::Control::yes) needs += ", control";
    if (row.needs.control == Needs::Control::where_applied)
      needs += ", control and the right to pose where `apply_as` is not 0";
    if (row.needs.recording) needs += ", recordings";
    expected += "| `" + names.at(row.message) + "` | `" + row.name + "` | " + needs + " |\n";
  }
  EXPECT_EQ(found, expected);
}

TEST(MessageTable, AHelloComesFirst) {
  ClientStage stage;
  for (const MessageRow& row : message_table()) {
    if (!row.needs.hello) continue;
    StageClient client(stage, false);
    const auto answer = client.send(empty_message(row.message));
    ASSERT_TRUE(answer) << row.name;
    EXPECT_EQ(answer->request_id(), 0U);
    EXPECT_EQ(answer->status().message(), "hello: it comes first and once (send ClientHello first)");
    EXPECT_TRUE(client.client().ending()) << row.name;
  }
  StageClient twice(stage);
  ASSERT_EQ(twice.hello().protocol(), 1U);
  EXPECT_EQ(twice.send(empty_message(v1::Envelope::kClientHello))->status().message(),
            "hello: it comes first and once (send ClientHello first)");
  EXPECT_TRUE(twice.client().ending());
}

TEST(MessageTable, AHelloThatIsRefusedEndsTheConnection) {
  ClientStage stage;
  StageClient client(stage, false);
  const MessageRow& row = *find_message(v1::Envelope::kClientHello);
  const Status status = refusal(row, client.send(empty_message(row.message)));
  EXPECT_EQ(status.code, StatusCode::failed_precondition);
  EXPECT_EQ(status.message,
            "hello: the client speaks protocol 0 to 0, this server 1 to 1 (use another client)");
  EXPECT_TRUE(client.client().ending());
}

TEST(MessageTable, WithoutAModel) {
  ClientStage stage;
  StageClient client(stage);
  for (const MessageRow& row : message_table()) {
    if (!row.needs.model) continue;
    const Status status = refusal(row, client.send(empty_message(row.message)));
    EXPECT_EQ(status.code, StatusCode::failed_precondition) << row.name;
    EXPECT_EQ(status.message, std::string(row.name) + ": no model is open (OpenModel first)");
  }
  EXPECT_FALSE(client.client().ending());
}

TEST(MessageTable, WithoutControl) {
  ClientStage stage;
  StageClient controller(stage), observer(stage);
  ASSERT_EQ(controller.open("shared").role(), v1::ROLE_CONTROLLER);
  ASSERT_EQ(observer.open("shared").role(), v1::ROLE_OBSERVER);
  int refused = 0;
  for (const MessageRow& row : message_table()) {
    if (!row.needs.model) continue;
    v1::Envelope request = empty_message(row.message);
    if (row.needs.control == Needs::Control::where_applied) {
      EXPECT_EQ(refusal(row, observer.send(request)).message, "ik: 0 targets (give 1 to 64)");
      request.mutable_solve_ik()->set_apply_as(1);
    }
    const Status status = refusal(row, observer.send(std::move(request)));
    const std::string text = std::string(row.name) +
                             ": this connection does not control session 'shared' (ClaimControl, or open a "
                             "session of your own)";
    if (row.needs.control == Needs::Control::no) {
      EXPECT_NE(status.message, text);
      continue;
    }
    ++refused;
    EXPECT_EQ(status.code, StatusCode::permission_denied) << row.name;
    EXPECT_EQ(status.message, text);
  }
  EXPECT_EQ(refused, 10);
}

TEST(MessageTable, WithoutRecordings) {
  ClientStage stage;
  StageClient client(stage);
  ASSERT_EQ(client.open("shared").role(), v1::ROLE_CONTROLLER);
  for (const bool on : {true, false}) {
    v1::Envelope request = empty_message(v1::Envelope::kRecord);
    request.mutable_record()->set_on(on);
    const Status status = refusal(*find_message(v1::Envelope::kRecord), client.send(std::move(request)));
    EXPECT_EQ(status.code, StatusCode::failed_precondition);
    EXPECT_EQ(status.message, "record: this server keeps no recordings (serve with --record-dir)");
  }
}

TEST(MessageTable, WhatHasNoRowIsUnimplementedAndTheConnectionGoesOn) {
  ClientStage stage;
  StageClient client(stage);
  for (const v1::Envelope& request : {empty_message(v1::Envelope::kServerHello), v1::Envelope()}) {
    const auto answer = client.send(request);
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->request_id(), request.request_id());
    const Status status = wire::from_proto(answer->status());
    EXPECT_EQ(status.code, StatusCode::unimplemented);
    EXPECT_EQ(status.message, "message " + std::to_string(request.message_case()) +
                                  ": this server cannot do it (see ServerHello.features)");
  }
  v1::Envelope ping;
  ping.mutable_ping()->set_data("here");
  EXPECT_EQ(client.send(ping)->pong().data(), "here");
}

}  // namespace
}  // namespace ecorche::server
