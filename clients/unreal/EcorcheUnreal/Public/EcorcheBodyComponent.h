// SPDX-License-Identifier: Apache-2.0
// Shows a server's body: a section of a procedural mesh for each tissue.
#pragma once

#include "CoreMinimal.h"
#include "ProceduralMeshComponent.h"

#include "EcorcheStream.h"

#include "EcorcheBodyComponent.generated.h"

UCLASS(ClassGroup = (Ecorche), meta = (BlueprintSpawnableComponent))
class ECORCHEUNREAL_API UEcorcheBodyComponent : public UProceduralMeshComponent {
  GENERATED_BODY()

 public:
  UEcorcheBodyComponent();

  /// HOST:PORT of `ecorche serve --listen`.
  UPROPERTY(EditAnywhere, Category = Ecorche)
  FString Address = TEXT("127.0.0.1:7070");
  /// Others who name it see the same body; empty: one of its own.
  UPROPERTY(EditAnywhere, Category = Ecorche)
  FString Session;
  UPROPERTY(EditAnywhere, Category = Ecorche)
  FString Token;
  /// A PEM file whose certificates are trusted; empty: no TLS.
  UPROPERTY(EditAnywhere, Category = Ecorche)
  FString Authorities;
  UPROPERTY(EditAnywhere, Category = Ecorche)
  UMaterialInterface* TissueMaterial = nullptr;

  /// An anatomical angle, radians ("elbow_left", "flexion"); shown with the next frames. False: the model has none such.
  UFUNCTION(BlueprintCallable, Category = Ecorche)
  bool SetAngle(const FString& Joint, const FString& Angle, float Radians);
  /// The tissue at a point of the world on the posed body; empty: none.
  UFUNCTION(BlueprintCallable, Category = Ecorche)
  FString Probe(const FVector& World);

  void BeginPlay() override;
  void EndPlay(const EEndPlayReason::Type Reason) override;
  void TickComponent(float Seconds, ELevelTick Kind, FActorComponentTickFunction* Tick) override;

 private:
  void ShowTissue(int32 Row, const FEcorcheTissue& Tissue);
  void Complain();

  FEcorcheStream Stream;
  FString Complained;
  bool Built = false;
  bool Turned = false;
};
