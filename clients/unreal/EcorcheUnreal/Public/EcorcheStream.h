// SPDX-License-Identifier: Apache-2.0
// A server's body in Unreal's space, over the C ABI. No Unreal in it: the component stands on this, and tests run it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <ecorche/ecorche_client.h>

/// A tissue: its vertices are written in place from frame to frame.
struct FEcorcheTissue {
  std::string Name;
  std::string Group;
  /// 3 a triangle, rows of vertices, wound as Unreal wants them.
  std::vector<int32_t> Triangles;
  /// 3 floats a vertex each: cm, and unit vectors.
  std::vector<float> Positions;
  std::vector<float> Normals;
};

/// One connection. For one thread at a time. Functions that can fail return false, and Error() says why.
class FEcorcheStream {
 public:
  FEcorcheStream() = default;
  ~FEcorcheStream();
  FEcorcheStream(const FEcorcheStream&) = delete;
  FEcorcheStream& operator=(const FEcorcheStream&) = delete;

  /// `Address`: HOST:PORT. `Session`: others who name it see the same body; "": one of its own. `Authorities`: a PEM file whose
  /// certificates are trusted; "": no TLS. Waits 5 s at most.
  bool Connect(const std::string& Address, const std::string& Session = "", const std::string& Token = "", const std::string& Authorities = "");
  void Close();
  bool IsOpen() const { return Client != nullptr; }
  const std::string& Error() const { return LastError; }

  const std::vector<FEcorcheTissue>& Tissues() const { return All; }

  /// An anatomical angle of the pose that is sent next, radians.
  bool SetAngle(const std::string& Joint, const std::string& Angle, double Radians);
  /// Sends it, and does not wait.
  bool SendPose();

  /// What came since the last call, without waiting; true where Tissues() has a new frame. After a lost line it comes back by itself, at
  /// most one try a call once `Seconds` since the last try have passed: a try may take 5 s, so call this from a thread of its own
  /// where the line may be lost.
  bool Poll(double Seconds);
  /// Which pose the frame shows; 0: the rest pose.
  uint64_t PoseSequence() const { return Shown; }

  /// What the posed body holds at a point in Unreal's space, cm: row of Tissues(), -1: none. Waits for the answer.
  bool Probe(const float Point[3], int32_t& Tissue);

 private:
  bool Fail();
  bool ReadTissues();
  bool CopyFrame();

  ecorche_client* Client = nullptr;
  std::vector<FEcorcheTissue> All;
  std::string LastError;
  uint64_t Shown = 0;
  double SinceTry = 0;
  bool Lost = false;
};
