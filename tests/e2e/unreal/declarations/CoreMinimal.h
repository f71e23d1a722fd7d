// SPDX-License-Identifier: Apache-2.0
// Declarations of what clients/unreal uses of Unreal's API, written by hand from its manual (5.1), so that it can be compiled without Unreal.
#pragma once

#include <cstdint>

#define UCLASS(...)
#define UPROPERTY(...)
#define UFUNCTION(...)
#define GENERATED_BODY() using Super = UProceduralMeshComponent;
#define ECORCHEUNREAL_API
#define TEXT(x) L##x
#define TCHAR_TO_UTF8(x) UnrealToUtf8(x)
#define UTF8_TO_TCHAR(x) Utf8ToUnreal(x)
#define UE_LOG(category, kind, format, ...) UnrealLog(format, __VA_ARGS__)

using int32 = int32_t;
using TCHAR = wchar_t;
const char* UnrealToUtf8(const TCHAR* text);
const TCHAR* Utf8ToUnreal(const char* text);
void UnrealLog(const TCHAR* format, ...);

class FString {
 public:
  FString();
  FString(const TCHAR* text);
  const TCHAR* operator*() const;
  bool IsEmpty() const;
  bool operator==(const FString& other) const;
};

struct FVector {
  double X, Y, Z;
  FVector(double x, double y, double z);
};
struct FVector2D {};
struct FColor {};

template <class T>
class TArray {
 public:
  void Reserve(int32 count);
  int32 Add(T item);
  void Append(const T* items, int32 count);
};

struct FTransform {
  FVector InverseTransformPosition(const FVector& world) const;
};
enum ELevelTick { LEVELTICK_All };
namespace EEndPlayReason {
enum Type { Destroyed };
}
struct FActorComponentTickFunction {
  bool bCanEverTick;
};
class UMaterialInterface;
