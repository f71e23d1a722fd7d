// SPDX-License-Identifier: Apache-2.0
#include "EcorcheStream.h"

#include <utility>

namespace {

constexpr double PauseSeconds = 2;

const char* OrNull(const std::string& Text) {
  return Text.empty() ? nullptr : Text.c_str();
}

}  // namespace

FEcorcheStream::~FEcorcheStream() {
  Close();
}

bool FEcorcheStream::Connect(const std::string& Address, const std::string& Session, const std::string& Token,
                             const std::string& Authorities) {
  Close();
  if (ecorche_client_abi_version() != ECORCHE_ABI_VERSION) {
    LastError = "libecorche_client is of another version than its header";
    return false;
  }
  ecorche_client_options Options = ECORCHE_CLIENT_OPTIONS_INIT;
  Options.name = "ecorche unreal";
  Options.token = OrNull(Token);
  Options.authorities = OrNull(Authorities);
  Options.session = OrNull(Session);
  if (ecorche_client_connect(Address.c_str(), &Options, &Client) != ECORCHE_OK) return Fail();
  if (ecorche_client_open(Client, nullptr, OrNull(Session)) != ECORCHE_OK ||
      ecorche_client_subscribe(Client, nullptr) != ECORCHE_OK || !ReadTissues()) {
    Fail();
    Close();
    return false;
  }
  return true;
}

void FEcorcheStream::Close() {
  ecorche_client_close(Client);
  Client = nullptr;
  All.clear();
  Shown = 0;
  Lost = false;
}

bool FEcorcheStream::SetAngle(const std::string& Joint, const std::string& Angle, double Radians) {
  return ecorche_client_set_angle(Client, Joint.c_str(), Angle.c_str(), Radians) == ECORCHE_OK || Fail();
}

bool FEcorcheStream::SendPose() {
  return ecorche_client_send_pose(Client, ECORCHE_SKINNING_COR, nullptr) == ECORCHE_OK || Fail();
}

bool FEcorcheStream::Poll(double Seconds) {
  if (Client == nullptr) return false;
  if (Lost) {
    SinceTry += Seconds;
    if (SinceTry < PauseSeconds) return false;
    SinceTry = 0;
    if (ecorche_client_resume(Client) != ECORCHE_OK) return Fail();
    Lost = false;
  }
  bool Came = false;
  ecorche_event Event = ECORCHE_EVENT_INIT;
  for (;;) {
    if (ecorche_client_poll(Client, 0, &Event) != ECORCHE_OK) {
      Lost = true;
      SinceTry = PauseSeconds;
      return Fail();
    }
    if (Event.kind == ECORCHE_EVENT_NONE) break;
    if (Event.kind == ECORCHE_EVENT_POSE && Event.code != ECORCHE_OK) Fail();
    if (Event.kind == ECORCHE_EVENT_MODEL_CHANGED)
      LastError = "the server has read the model anew (connect again)";
    if (Event.kind != ECORCHE_EVENT_FRAME) continue;
    Came = true;
    Shown = Event.sequence;
  }
  return Came && CopyFrame();
}

bool FEcorcheStream::Probe(const float Point[3], int32_t& Tissue) {
  // ECORCHE_SPACE_UNREAL: x forward, y right, z up, cm.
  const float Lps[3] = {-10 * Point[1], -10 * Point[0], 10 * Point[2]};
  ecorche_probed Found = ECORCHE_PROBED_INIT;
  Found.tissues = &Tissue;
  return ecorche_client_posed_to_rest(Client, Lps, 1, &Found) == ECORCHE_OK || Fail();
}

bool FEcorcheStream::Fail() {
  LastError = ecorche_client_error_message();
  return false;
}

bool FEcorcheStream::ReadTissues() {
  const uint32_t Count = ecorche_client_tissue_count(Client);
  for (uint32_t Row = 0; Row < Count; ++Row) {
    ecorche_tissue_info Info = ECORCHE_TISSUE_INFO_INIT;
    if (ecorche_client_tissue(Client, Row, &Info) != ECORCHE_OK) return false;
    FEcorcheTissue Tissue;
    Tissue.Name = Info.name;
    Tissue.Group = Info.group;
    // As they are: in a mirror, counter-clockwise becomes clockwise by the right hand's rule; and Unreal,
    // whose space is a mirror, takes the side from where corners go counter-clockwise by eye (its normal of a
    // triangle is (p1 - p2) x (p0 - p2)).
    Tissue.Triangles.assign(Info.triangles, Info.triangles + 3 * size_t{Info.triangle_count});
    Tissue.Positions.resize(3 * size_t{Info.vertex_count});
    Tissue.Normals.resize(3 * size_t{Info.vertex_count});
    All.push_back(std::move(Tissue));
  }
  return true;
}

bool FEcorcheStream::CopyFrame() {
  for (uint32_t Row = 0; Row < All.size(); ++Row) {
    FEcorcheTissue& Tissue = All[Row];
    if (ecorche_client_copy(Client, Row, ECORCHE_SPACE_UNREAL, Tissue.Positions.data(), 0,
                            Tissue.Normals.data(), 0, Tissue.Positions.size() / 3) != ECORCHE_OK)
      return Fail();
  }
  return true;
}
