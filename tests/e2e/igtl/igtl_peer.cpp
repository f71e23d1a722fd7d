// SPDX-License-Identifier: Apache-2.0
// A client of OpenIGTLink by its project's own library: does what stdin says, and prints what came, a line of
// JSON each. What is large goes into a file.
//   usage: igtl_peer PORT FOLDER
#include <igtlCapabilityMessage.h>
#include <igtlClientSocket.h>
#include <igtlImageMessage.h>
#include <igtlPointMessage.h>
#include <igtlPolyDataMessage.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTrackingDataMessage.h>
#include <igtlTransformMessage.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

namespace {

using nlohmann::json;

igtl::ClientSocket::Pointer socket_of_server;
std::string folder;

void send(igtl::MessageBase* message, const std::string& device) {
  message->SetDeviceName(device.c_str());
  message->Pack();
  if (socket_of_server->Send(message->GetPackPointer(), message->GetPackSize()) == 0) std::exit(3);
}

json columns_of(const igtl::Matrix4x4& m) {
  json out;
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row) out.push_back(m[row][column]);
  return out;
}

void read_columns(std::istream& words, igtl::Matrix4x4& m) {
  igtl::IdentityMatrix(m);
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row) words >> m[row][column];
}

template <class T>
void put(const std::string& file, const std::vector<T>& numbers) {
  std::ofstream(folder + "/" + file, std::ios::binary)
      .write(reinterpret_cast<const char*>(numbers.data()),
             static_cast<std::streamsize>(numbers.size() * sizeof(T)));
}

// Fills `message` from the wire; its checksum must be right.
template <class Pointer>
Pointer body(igtl::MessageHeader::Pointer header, Pointer message) {
  message->SetMessageHeader(header);
  message->AllocatePack();
  const int bytes = message->GetPackBodySize();
  if (bytes > 0 && socket_of_server->Receive(message->GetPackBodyPointer(), bytes) != bytes) std::exit(3);
  if ((message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) == 0) {
    std::cerr << "the library does not take " << header->GetDeviceType() << "\n";
    std::exit(4);
  }
  return message;
}

json surface(const igtl::PolyDataMessage::Pointer& message) {
  std::vector<float> points, normals;
  std::vector<std::uint32_t> triangles;
  for (int i = 0; i < message->GetPoints()->GetNumberOfPoints(); ++i) {
    float at[3];
    message->GetPoints()->GetPoint(static_cast<unsigned>(i), at);
    points.insert(points.end(), at, at + 3);
  }
  for (unsigned i = 0; i < message->GetPolygons()->GetNumberOfCells(); ++i) {
    igtlUint32 cell[3];
    if (message->GetPolygons()->GetCellSize(i) != 3) std::exit(5);
    message->GetPolygons()->GetCell(i, cell);
    triangles.insert(triangles.end(), cell, cell + 3);
  }
  igtl::PolyDataAttribute::Pointer attribute = message->GetAttribute(0u);
  for (unsigned i = 0; i < attribute->GetSize(); ++i) {
    float normal[3];
    attribute->GetNthData(i, normal);
    normals.insert(normals.end(), normal, normal + 3);
  }
  const std::string name = message->GetDeviceName();
  put(name + ".points", points);
  put(name + ".triangles", triangles);
  put(name + ".normals", normals);
  return {{"points", points.size() / 3},
          {"triangles", triangles.size() / 3},
          {"attribute", attribute->GetName()},
          {"kind", attribute->GetType()}};
}

json image(const igtl::ImageMessage::Pointer& message) {
  int size[3];
  message->GetDimensions(size);
  igtl::Matrix4x4 matrix;
  message->GetMatrix(matrix);
  float spacing[3];
  message->GetSpacing(spacing);
  const auto* bytes = static_cast<const char*>(message->GetScalarPointer());
  put(std::string(message->GetDeviceName()) + ".voxels",
      std::vector<char>(bytes, bytes + message->GetImageSize()));
  return {{"size", size},
          {"matrix", columns_of(matrix)},
          {"spacing", spacing},
          {"scalar", message->GetScalarType()},
          {"endian", message->GetEndian()},
          {"coordinates", message->GetCoordinateSystem()}};
}

json told(const igtl::MessageHeader::Pointer& header) {
  const std::string type = header->GetDeviceType();
  json out{{"type", type}, {"device", header->GetDeviceName()}};
  if (type == "TRANSFORM") {
    igtl::Matrix4x4 matrix;
    body(header, igtl::TransformMessage::New())->GetMatrix(matrix);
    out["at"] = columns_of(matrix);
  } else if (type == "TDATA") {
    const auto message = body(header, igtl::TrackingDataMessage::New());
    for (int i = 0; i < message->GetNumberOfTrackingDataElements(); ++i) {
      igtl::TrackingDataElement::Pointer element;
      message->GetTrackingDataElement(i, element);
      igtl::Matrix4x4 matrix;
      element->GetMatrix(matrix);
      out["tools"][element->GetName()] = columns_of(matrix);
    }
  } else if (type == "POLYDATA") {
    out.update(surface(body(header, igtl::PolyDataMessage::New())));
  } else if (type == "IMAGE") {
    out.update(image(body(header, igtl::ImageMessage::New())));
  } else if (type == "POINT") {
    const auto message = body(header, igtl::PointMessage::New());
    for (int i = 0; i < message->GetNumberOfPointElement(); ++i) {
      igtl::PointElement::Pointer element;
      message->GetPointElement(i, element);
      float at[3];
      element->GetPosition(at);
      out["points"].push_back({{"name", element->GetName()}, {"group", element->GetGroupName()}, {"at", at}});
    }
  } else if (type == "STATUS") {
    const auto message = body(header, igtl::StatusMessage::New());
    out["code"] = message->GetCode();
    out["text"] = message->GetStatusString();
  } else if (type == "CAPABILITY") {
    out["types"] = body(header, igtl::CapabilityMessage::New())->GetTypes();
  } else if (type == "RTS_TDATA") {
    out["status"] = body(header, igtl::RTSTrackingDataMessage::New())->GetStatus();
  } else {
    out["unexpected"] = true;
    socket_of_server->Skip(static_cast<int>(header->GetBodySizeToRead()), 1);
  }
  return out;
}

// Until a message of this type, and of this device where one is named.
void wait_for(const std::string& type, const std::string& device) {
  for (;;) {
    const auto header = igtl::MessageHeader::New();
    header->InitPack();
    if (socket_of_server->Receive(header->GetPackPointer(), header->GetPackSize()) != header->GetPackSize()) {
      std::cout << json{{"gone", true}} << std::endl;
      return;
    }
    header->Unpack();
    const json line = told(header);
    if (line["type"] != type || (!device.empty() && line["device"] != device)) continue;
    std::cout << line << std::endl;
    return;
  }
}

void send_tools(std::istream& words, std::string name) {
  const auto message = igtl::TrackingDataMessage::New();
  for (; words; words >> name) {
    auto element = igtl::TrackingDataElement::New();
    igtl::Matrix4x4 matrix;
    read_columns(words, matrix);
    element->SetName(name.c_str());
    element->SetType(igtl::TrackingDataElement::TYPE_6D);
    element->SetMatrix(matrix);
    message->AddTrackingDataElement(element);
  }
  send(message, "tracker");
}

void obey(std::istream& words) {
  std::string what, name;
  words >> what >> name;
  if (what == "wait") {
    std::string device;
    words >> device;
    wait_for(name, device);
  } else if (what == "transform") {
    const auto message = igtl::TransformMessage::New();
    igtl::Matrix4x4 matrix;
    read_columns(words, matrix);
    message->SetMatrix(matrix);
    send(message, name);
  } else if (what == "tools") {
    send_tools(words, name);
  } else if (what == "point") {
    const auto message = igtl::PointMessage::New();
    auto element = igtl::PointElement::New();
    float x = 0, y = 0, z = 0;
    words >> x >> y >> z;
    element->SetName("p");
    element->SetPosition(x, y, z);
    message->AddPointElement(element);
    send(message, name);
  } else if (what == "string") {
    const auto message = igtl::StringMessage::New();
    std::string text;
    words >> text;
    message->SetString(text.c_str());
    send(message, name);
  } else if (what == "track") {
    const auto message = igtl::StartTrackingDataMessage::New();
    message->SetResolution(std::stoi(name));
    message->SetCoordinateName("patient");
    send(message, "joints");
  } else if (what == "untrack") {
    send(igtl::StopTrackingDataMessage::New(), "joints");
  } else if (what == "capabilities") {
    send(igtl::GetCapabilityMessage::New(), "");
  } else if (what == "get_transform") {
    send(igtl::GetTransformMessage::New(), name);
  } else {
    std::cerr << "no command " << what << "\n";
    std::exit(64);
  }
}

}  // namespace

int main(int, char** argv) try {
  folder = argv[2];
  socket_of_server = igtl::ClientSocket::New();
  if (socket_of_server->ConnectToServer("127.0.0.1", std::atoi(argv[1])) != 0) return 2;
  socket_of_server->SetTimeout(60000);
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    obey(words);
  }
  socket_of_server->CloseSocket();
  return 0;
} catch (const std::exception& error) {
  std::cerr << error.what() << "\n";
  return 70;
}
