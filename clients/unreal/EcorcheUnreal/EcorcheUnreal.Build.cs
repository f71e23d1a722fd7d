// SPDX-License-Identifier: Apache-2.0
using System;
using System.IO;
using UnrealBuildTool;

// Not "Ecorche": Unreal would make its macro ECORCHE_API, which ecorche.h has.
public class EcorcheUnreal : ModuleRules
{
    public EcorcheUnreal(ReadOnlyTargetRules Target) : base(Target)
    {
        PCHUsage = PCHUsageMode.UseExplicitOrSharedPCHs;
        PublicDependencyModuleNames.AddRange(new[] { "Core", "CoreUObject", "Engine", "ProceduralMeshComponent" });
        // Where `cmake --install` put ecorche.
        string root = Environment.GetEnvironmentVariable("ECORCHE_ROOT") ?? "/usr";
        PublicSystemIncludePaths.Add(Path.Combine(root, "include"));
        if (Target.Platform == UnrealTargetPlatform.Win64)
        {
            PublicAdditionalLibraries.Add(Path.Combine(root, "lib", "ecorche_client.lib"));
            RuntimeDependencies.Add("$(BinaryOutputDir)/ecorche_client.dll", Path.Combine(root, "bin", "ecorche_client.dll"));
        }
        else
        {
            PublicAdditionalLibraries.Add(Path.Combine(root, "lib", "libecorche_client.so"));
        }
    }
}
