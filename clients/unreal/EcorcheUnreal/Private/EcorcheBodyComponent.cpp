// SPDX-License-Identifier: Apache-2.0
#include "EcorcheBodyComponent.h"

namespace {

std::string Utf8(const FString& Text) {
  return TCHAR_TO_UTF8(*Text);
}

}  // namespace

UEcorcheBodyComponent::UEcorcheBodyComponent() {
  PrimaryComponentTick.bCanEverTick = true;
}

void UEcorcheBodyComponent::BeginPlay() {
  Super::BeginPlay();
  if (!Stream.Connect(Utf8(Address), Utf8(Session), Utf8(Token), Utf8(Authorities))) Complain();
}

void UEcorcheBodyComponent::EndPlay(const EEndPlayReason::Type Reason) {
  Stream.Close();
  ClearAllMeshSections();
  Built = false;
  Super::EndPlay(Reason);
}

void UEcorcheBodyComponent::TickComponent(float Seconds, ELevelTick Kind, FActorComponentTickFunction* Tick) {
  Super::TickComponent(Seconds, Kind, Tick);
  if (!Stream.IsOpen()) return;
  if (Turned && !Stream.SendPose()) Complain();
  Turned = false;
  if (!Stream.Poll(Seconds)) {
    Complain();
    return;
  }
  const std::vector<FEcorcheTissue>& Tissues = Stream.Tissues();
  for (int32 Row = 0; Row < static_cast<int32>(Tissues.size()); ++Row) ShowTissue(Row, Tissues[Row]);
  Built = true;
}

void UEcorcheBodyComponent::ShowTissue(int32 Row, const FEcorcheTissue& Tissue) {
  const int32 Count = static_cast<int32>(Tissue.Positions.size() / 3);
  TArray<FVector> Positions, Normals;
  Positions.Reserve(Count);
  Normals.Reserve(Count);
  for (int32 Vertex = 0; Vertex < Count; ++Vertex) {
    const float* P = &Tissue.Positions[3 * Vertex];
    const float* N = &Tissue.Normals[3 * Vertex];
    Positions.Add(FVector(P[0], P[1], P[2]));
    Normals.Add(FVector(N[0], N[1], N[2]));
  }
  const TArray<FVector2D> NoUv;
  const TArray<FColor> NoColours;
  const TArray<FProcMeshTangent> NoTangents;
  if (Built) {
    UpdateMeshSection(Row, Positions, Normals, NoUv, NoColours, NoTangents);
    return;
  }
  TArray<int32> Triangles;
  Triangles.Append(Tissue.Triangles.data(), static_cast<int32>(Tissue.Triangles.size()));
  CreateMeshSection(Row, Positions, Triangles, Normals, NoUv, NoColours, NoTangents, false);
  SetMaterial(Row, TissueMaterial);
}

bool UEcorcheBodyComponent::SetAngle(const FString& Joint, const FString& Angle, float Radians) {
  if (!Stream.IsOpen() || !Stream.SetAngle(Utf8(Joint), Utf8(Angle), Radians)) {
    Complain();
    return false;
  }
  Turned = true;
  return true;
}

FString UEcorcheBodyComponent::Probe(const FVector& World) {
  const FVector Local = GetComponentTransform().InverseTransformPosition(World);
  const float Point[3] = {static_cast<float>(Local.X), static_cast<float>(Local.Y),
                          static_cast<float>(Local.Z)};
  int32 Tissue = -1;
  if (!Stream.IsOpen() || !Stream.Probe(Point, Tissue)) Complain();
  return Tissue < 0 ? FString() : FString(UTF8_TO_TCHAR(Stream.Tissues()[Tissue].Name.c_str()));
}

void UEcorcheBodyComponent::Complain() {
  const FString Told = UTF8_TO_TCHAR(Stream.Error().c_str());
  if (Told.IsEmpty() || Told == Complained) return;
  Complained = Told;
  UE_LOG(LogTemp, Warning, TEXT("ecorche: %s"), *Told);
}
