// SPDX-License-Identifier: Apache-2.0
// Declarations of what the package uses of Unity's API, written by hand from its manual (2021.3), so that the package can be compiled without Unity.
// No bodies: nothing here runs.
using System;

namespace UnityEngine
{
    public class Object
    {
        public string name { get; set; }
        public static implicit operator bool(Object one) => throw null;
        public static bool operator ==(Object a, Object b) => throw null;
        public static bool operator !=(Object a, Object b) => throw null;
        public override bool Equals(object other) => throw null;
        public override int GetHashCode() => throw null;
        public static void Destroy(Object one) { }
        public static void DestroyImmediate(Object one) { }
    }

    public class Component : Object
    {
        public GameObject gameObject => throw null;
        public Transform transform => throw null;
        public T GetComponent<T>() => throw null;
        public T[] GetComponentsInChildren<T>() => throw null;
    }

    public class Behaviour : Component
    {
        public bool enabled { get; set; }
    }

    public class MonoBehaviour : Behaviour { }

    public sealed class GameObject : Object
    {
        public GameObject(string name) { }
        public Transform transform => throw null;
        public T AddComponent<T>() where T : Component => throw null;
        public void SetActive(bool active) { }
    }

    public class Transform : Component
    {
        public Vector3 position { get; set; }
        public Quaternion rotation { get; set; }
        public Matrix4x4 localToWorldMatrix => throw null;
        public void SetParent(Transform parent, bool worldPositionStays) { }
        public Vector3 TransformPoint(Vector3 point) => throw null;
        public Vector3 InverseTransformPoint(Vector3 point) => throw null;
    }

    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) => throw null;
        public static Vector3 operator -(Vector3 a, Vector3 b) => throw null;
        public static Vector3 operator *(float a, Vector3 b) => throw null;
        public static Vector3 up => throw null;
    }

    public struct Vector4
    {
        public Vector4(float x, float y, float z, float w) => throw null;
    }

    public struct Quaternion
    {
        public float x, y, z, w;
        public static Quaternion Inverse(Quaternion one) => throw null;
        public static Quaternion operator *(Quaternion a, Quaternion b) => throw null;
        public static Vector3 operator *(Quaternion a, Vector3 b) => throw null;
    }

    public struct Matrix4x4 { }

    // Named as types of the package are.
    public enum Space { World, Self }

    public struct Pose { }

    public struct Bounds
    {
        public Bounds(Vector3 center, Vector3 size) => throw null;
    }

    public class TextAsset : Object
    {
        public string text => throw null;
    }

    public class Material : Object { }

    public class Shader : Object
    {
        public static int PropertyToID(string name) => throw null;
    }

    public sealed class MaterialPropertyBlock
    {
        public void SetMatrix(int name, Matrix4x4 value) { }
        public void SetVector(int name, Vector4 value) { }
        public void SetInt(int name, int value) { }
        public void SetBuffer(int name, GraphicsBuffer value) { }
    }

    public sealed class ComputeShader : Object
    {
        public void SetBuffer(int kernel, string name, GraphicsBuffer buffer) { }
        public void SetFloat(string name, float value) { }
        public void SetInt(string name, int value) { }
        public void Dispatch(int kernel, int x, int y, int z) { }
        public void EnableKeyword(string keyword) { }
        public void DisableKeyword(string keyword) { }
    }

    public sealed class GraphicsBuffer
    {
        [Flags]
        public enum Target { Vertex = 1, Index = 2, Structured = 16, Raw = 32 }

        public GraphicsBuffer(Target target, int count, int stride) { }
        public int count => throw null;
        public void SetData(Array data) { }
        public void Release() { }
    }

    public static class Graphics
    {
        public static void DrawProcedural(Material material, Bounds bounds, MeshTopology topology, GraphicsBuffer indexBuffer, int indexCount,
            int instanceCount = 1, Camera camera = null, MaterialPropertyBlock properties = null) { }
    }

    public sealed class Camera : Behaviour { }

    public enum MeshTopology { Triangles = 0, Quads = 2, Lines = 3, LineStrip = 4, Points = 5 }

    public sealed class Mesh : Object
    {
        public Bounds bounds { get; set; }
        public int subMeshCount { get; set; }
        public void Clear() { }
        public void MarkDynamic() { }
        public void SetVertexBufferParams(int vertexCount, params Rendering.VertexAttributeDescriptor[] attributes) { }
        public void SetVertexBufferData<T>(T[] data, int dataStart, int meshBufferStart, int count, int stream = 0, Rendering.MeshUpdateFlags flags = 0)
            where T : struct { }
        public void SetIndexBufferParams(int indexCount, Rendering.IndexFormat format) { }
        public void SetIndexBufferData<T>(T[] data, int dataStart, int meshBufferStart, int count, Rendering.MeshUpdateFlags flags = 0) where T : struct { }
        public void SetSubMesh(int index, Rendering.SubMeshDescriptor descriptor, Rendering.MeshUpdateFlags flags = 0) { }
    }

    public sealed class MeshFilter : Component
    {
        public Mesh sharedMesh { get; set; }
    }

    public class Renderer : Component
    {
        public Material sharedMaterial { get; set; }
    }

    public sealed class MeshRenderer : Renderer { }

    public sealed class Avatar : Object { }

    public sealed class Animator : Behaviour
    {
        public Avatar avatar => throw null;
        public bool isHuman => throw null;
        public Transform GetBoneTransform(HumanBodyBones bone) => throw null;
    }

    public enum HumanBodyBones
    {
        Hips, LeftUpperLeg, RightUpperLeg, LeftLowerLeg, RightLowerLeg, LeftFoot, RightFoot, Spine, Chest, Neck, Head, LeftShoulder, RightShoulder,
        LeftUpperArm, RightUpperArm, LeftLowerArm, RightLowerArm, LeftHand, RightHand, LeftToes, RightToes,
    }

    public struct HumanPose
    {
        public float[] muscles;
    }

    public sealed class HumanPoseHandler : IDisposable
    {
        public HumanPoseHandler(Avatar avatar, Transform root) { }
        public void GetHumanPose(ref HumanPose pose) { }
        public void SetHumanPose(ref HumanPose pose) { }
        public void Dispose() { }
    }

    public static class HumanTrait
    {
        public static int MuscleCount => throw null;
    }

    public static class Debug
    {
        public static void Log(object message) { }
        public static void LogWarning(object message, Object context) { }
    }

    public static class Time
    {
        public static float time => throw null;
    }

    public static class Mathf
    {
        public static float Sin(float radians) => throw null;
    }

    [AttributeUsage(AttributeTargets.Class)]
    public sealed class AddComponentMenu : Attribute
    {
        public AddComponentMenu(string path) { }
    }

    [AttributeUsage(AttributeTargets.Class)]
    public sealed class DefaultExecutionOrder : Attribute
    {
        public DefaultExecutionOrder(int order) { }
    }

    [AttributeUsage(AttributeTargets.Field)]
    public sealed class TooltipAttribute : Attribute
    {
        public TooltipAttribute(string text) { }
    }

    [AttributeUsage(AttributeTargets.Field)]
    public sealed class RangeAttribute : Attribute
    {
        public RangeAttribute(float min, float max) { }
    }
}

namespace UnityEngine.Rendering
{
    [Flags]
    public enum MeshUpdateFlags { Default = 0, DontValidateIndices = 1, DontResetBoneBounds = 2, DontNotifyMeshUsers = 4, DontRecalculateBounds = 8 }

    public enum IndexFormat { UInt16, UInt32 }

    public enum VertexAttribute { Position, Normal, Tangent, Color, TexCoord0 }

    public enum VertexAttributeFormat { Float32, Float16, UNorm8, SNorm8, UNorm16, SNorm16, UInt8, SInt8, UInt16, SInt16, UInt32, SInt32 }

    public struct VertexAttributeDescriptor
    {
        public VertexAttributeDescriptor(VertexAttribute attribute, VertexAttributeFormat format, int dimension, int stream) => throw null;
    }

    public struct SubMeshDescriptor
    {
        public SubMeshDescriptor(int indexStart, int indexCount, MeshTopology topology) => throw null;
    }
}
