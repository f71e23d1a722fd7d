// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "CoreMinimal.h"

struct FProcMeshTangent {};

class UProceduralMeshComponent {
 public:
  virtual ~UProceduralMeshComponent();
  virtual void BeginPlay();
  virtual void EndPlay(const EEndPlayReason::Type reason);
  virtual void TickComponent(float seconds, ELevelTick kind, FActorComponentTickFunction* tick);
  void CreateMeshSection(int32 section, const TArray<FVector>& vertices, const TArray<int32>& triangles, const TArray<FVector>& normals,
                         const TArray<FVector2D>& uv, const TArray<FColor>& colours, const TArray<FProcMeshTangent>& tangents, bool collision);
  void UpdateMeshSection(int32 section, const TArray<FVector>& vertices, const TArray<FVector>& normals, const TArray<FVector2D>& uv,
                         const TArray<FColor>& colours, const TArray<FProcMeshTangent>& tangents);
  void ClearAllMeshSections();
  void SetMaterial(int32 section, UMaterialInterface* material);
  const FTransform& GetComponentTransform() const;

 protected:
  FActorComponentTickFunction PrimaryComponentTick;
};
