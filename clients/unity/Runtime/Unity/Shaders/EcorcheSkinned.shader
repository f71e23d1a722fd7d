// SPDX-License-Identifier: Apache-2.0
// Draws what EcorcheSkinning.compute has posed: 8 bytes a vertex, numbers of 16 bits and an octahedral normal. One light, from the eye.
Shader "Ecorche/Skinned"
{
    Properties
    {
        _Color ("Color", Color) = (0.85, 0.75, 0.7, 1)
    }
    SubShader
    {
        Tags { "RenderType" = "Opaque" "Queue" = "Geometry" }
        Pass
        {
            HLSLPROGRAM
            #pragma target 4.5
            #pragma vertex vertex
            #pragma fragment fragment
            #include "UnityCG.cginc"

            StructuredBuffer<uint2> _Posed;
            uint _First;             // of the tissue
            float4 _Box;             // where number 0 lies, LPS mm, and mm between numbers
            float4x4 _BodyToWorld;
            float4 _Color;

            struct Varying
            {
                float4 place : SV_Position;
                float3 normal : TEXCOORD0;
                float3 eye : TEXCOORD1;
            };

            // LPS to Unity's axes.
            float3 turned(float3 v) { return float3(-v.x, v.z, -v.y); }

            float3 decode(uint code)
            {
                float2 uv = (float2(code & 255u, code >> 8) - 128.0) / 127.0;
                float3 n = float3(uv, 1.0 - abs(uv.x) - abs(uv.y));
                if (n.z < 0.0) n.xy = (1.0 - abs(uv.yx)) * float2(uv.x < 0.0 ? -1.0 : 1.0, uv.y < 0.0 ? -1.0 : 1.0);
                return normalize(n);
            }

            Varying vertex(uint row : SV_VertexID)
            {
                uint2 posed = _Posed[_First + row];
                float3 lps = _Box.xyz + _Box.w * float3(posed.x & 65535u, posed.x >> 16, posed.y & 65535u);
                float4 world = mul(_BodyToWorld, float4(1e-3 * turned(lps), 1.0));
                Varying to;
                to.place = mul(UNITY_MATRIX_VP, world);
                to.normal = mul((float3x3)_BodyToWorld, turned(decode(posed.y >> 16)));
                to.eye = _WorldSpaceCameraPos - world.xyz;
                return to;
            }

            float4 fragment(Varying from) : SV_Target
            {
                float lit = 0.25 + 0.75 * saturate(dot(normalize(from.normal), normalize(from.eye)));
                return float4(_Color.rgb * lit, 1.0);
            }
            ENDHLSL
        }
    }
}
