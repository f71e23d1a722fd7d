// SPDX-License-Identifier: Apache-2.0
using System;
using System.Runtime.InteropServices;

namespace Ecorche.Native
{
    /// <summary>libecorche, as ecorche.h declares it.</summary>
    internal static class NativeMethods
    {
        private const string Library = "ecorche";

        /// <summary>ECORCHE_ABI_VERSION of the header that this was written by.</summary>
        public const uint Abi = 0;

        [StructLayout(LayoutKind.Sequential)]
        public struct TissueInfo
        {
            public UIntPtr StructSize;
            public IntPtr Name, Group;
            public uint VertexCount, TriangleCount;
            public IntPtr Triangles, Rest;
            public int Segment;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct BodyOptions
        {
            public UIntPtr StructSize;
            public int Normals;
            public uint Threads;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Quality
        {
            public UIntPtr StructSize;
            public int Pass;
            public uint ReasonCount;
            public ulong InvertedTets;
            public double InvertedShare, MinDetF, VolumeChange, BoneRigidity, BoneOverlap;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Probed
        {
            public UIntPtr StructSize;
            public IntPtr Points, Tets, Tissues, Gradients, Values;
            public int Volume;
        }

        [DllImport(Library)] public static extern uint ecorche_abi_version();
        [DllImport(Library)] public static extern IntPtr ecorche_error_message();
        [DllImport(Library)] public static extern int ecorche_space_matrix(Space space, double[] matrix);
        [DllImport(Library)] public static extern Code ecorche_model_open(byte[] path, out IntPtr model);
        [DllImport(Library)] public static extern void ecorche_model_close(IntPtr model);
        [DllImport(Library)] public static extern IntPtr ecorche_model_name(IntPtr model);
        [DllImport(Library)] public static extern uint ecorche_model_tissue_count(IntPtr model);
        [DllImport(Library)] public static extern Code ecorche_model_tissue(IntPtr model, uint tissue, ref TissueInfo info);
        [DllImport(Library)] public static extern int ecorche_model_find_tissue(IntPtr model, byte[] name);
        [DllImport(Library)] public static extern uint ecorche_model_segment_count(IntPtr model);
        [DllImport(Library)] public static extern int ecorche_model_find_segment(IntPtr model, byte[] name);
        [DllImport(Library)] public static extern Code ecorche_pose_create(IntPtr model, out IntPtr pose);
        [DllImport(Library)] public static extern void ecorche_pose_destroy(IntPtr pose);
        [DllImport(Library)] public static extern Code ecorche_pose_reset(IntPtr pose);
        [DllImport(Library)] public static extern Code ecorche_pose_load(IntPtr pose, byte[] name);
        [DllImport(Library)] public static extern Code ecorche_pose_set_angle(IntPtr pose, byte[] joint, byte[] angle, double radians);
        [DllImport(Library)] public static extern Code ecorche_pose_set_rotation(IntPtr pose, uint segment, double[] xyzw);
        [DllImport(Library)] public static extern Code ecorche_pose_set_root(IntPtr pose, double[] translation);
        [DllImport(Library)] public static extern Code ecorche_body_create(IntPtr model, ref BodyOptions options, out IntPtr body);
        [DllImport(Library)] public static extern void ecorche_body_destroy(IntPtr body);
        [DllImport(Library)] public static extern Code ecorche_body_update(IntPtr body, IntPtr pose, int skinning, uint[] tissues, UIntPtr count);
        [DllImport(Library)]
        public static extern Code ecorche_body_copy(IntPtr body, uint tissue, Space space, IntPtr positions, UIntPtr positionStride, IntPtr normals,
            UIntPtr normalStride, UIntPtr capacity);
        [DllImport(Library)] public static extern Code ecorche_body_measure(IntPtr body, int sampled, ref Quality quality);
        [DllImport(Library)] public static extern Code ecorche_body_posed_to_rest(IntPtr body, float[] points, UIntPtr count, ref Probed probed);
        [DllImport(Library)] public static extern Code ecorche_body_rest_to_posed(IntPtr body, float[] points, UIntPtr count, ref Probed probed);

        public static byte[] Utf8(string text) => System.Text.Encoding.UTF8.GetBytes(text + "\0");

        public static string Text(IntPtr utf8)
        {
            if (utf8 == IntPtr.Zero) return "";
            int size = 0;
            while (Marshal.ReadByte(utf8, size) != 0) ++size;
            var bytes = new byte[size];
            Marshal.Copy(utf8, bytes, 0, size);
            return System.Text.Encoding.UTF8.GetString(bytes);
        }

        public static void Check(Code code)
        {
            if (code != Code.Ok) throw new EcorcheException(code, Text(ecorche_error_message()));
        }

        public static UIntPtr SizeOf<T>() where T : struct => (UIntPtr)Marshal.SizeOf(default(T));
    }
}
