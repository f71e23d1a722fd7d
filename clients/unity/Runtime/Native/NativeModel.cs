// SPDX-License-Identifier: Apache-2.0
using System;
using System.Runtime.InteropServices;

namespace Ecorche.Native
{
    /// <summary>A surface of a model.</summary>
    public sealed class NativeTissue
    {
        public string Name { get; internal set; }
        public string Group { get; internal set; }
        public int VertexCount { get; internal set; }
        /// <summary>Three corners each, counter-clockwise seen from outside in LPS.</summary>
        public int[] Triangles { get; internal set; }
        /// <summary>That a bone moves with; -1: it bends.</summary>
        public int Segment { get; internal set; }
    }

    /// <summary>A prepared body, in process: needs the library of libecorche for the machine it runs on. For any number of threads.</summary>
    public sealed class NativeModel : IDisposable
    {
        internal IntPtr Handle { get; private set; }

        /// <exception cref="EcorcheException">NotFound; InvalidArgument: no model, or damaged; FailedPrecondition: the library is of another version.</exception>
        public NativeModel(string path)
        {
            uint abi = NativeMethods.ecorche_abi_version();
            if (abi != NativeMethods.Abi)
                throw new EcorcheException(Code.FailedPrecondition, "libecorche has ABI " + abi + ", this package needs " + NativeMethods.Abi);
            NativeMethods.Check(NativeMethods.ecorche_model_open(NativeMethods.Utf8(path), out var handle));
            Handle = handle;
        }

        public string Name => NativeMethods.Text(NativeMethods.ecorche_model_name(Handle));
        public int TissueCount => (int)NativeMethods.ecorche_model_tissue_count(Handle);
        public int SegmentCount => (int)NativeMethods.ecorche_model_segment_count(Handle);

        /// <summary>The row of a name; -1 where there is none.</summary>
        public int FindTissue(string name) => NativeMethods.ecorche_model_find_tissue(Handle, NativeMethods.Utf8(name));

        /// <summary>The row of a segment's or a joint's name; -1 where there is none.</summary>
        public int FindSegment(string name) => NativeMethods.ecorche_model_find_segment(Handle, NativeMethods.Utf8(name));

        public NativeTissue Tissue(int row)
        {
            var info = new NativeMethods.TissueInfo { StructSize = NativeMethods.SizeOf<NativeMethods.TissueInfo>() };
            NativeMethods.Check(NativeMethods.ecorche_model_tissue(Handle, (uint)row, ref info));
            var triangles = new int[3 * info.TriangleCount];
            Marshal.Copy(info.Triangles, triangles, 0, triangles.Length);
            return new NativeTissue
            {
                Name = NativeMethods.Text(info.Name), Group = NativeMethods.Text(info.Group), VertexCount = (int)info.VertexCount,
                Triangles = triangles, Segment = info.Segment,
            };
        }

        public void Dispose()
        {
            NativeMethods.ecorche_model_close(Handle);
            Handle = IntPtr.Zero;
            GC.SuppressFinalize(this);
        }

        ~NativeModel() => NativeMethods.ecorche_model_close(Handle);
    }

    /// <summary>How every joint is turned. For one thread at a time.</summary>
    public sealed class NativePose : IDisposable
    {
        internal IntPtr Handle { get; private set; }

        /// <summary>As scanned.</summary>
        public NativePose(NativeModel model)
        {
            NativeMethods.Check(NativeMethods.ecorche_pose_create(model.Handle, out var handle));
            Handle = handle;
        }

        public NativePose Reset() => Checked(NativeMethods.ecorche_pose_reset(Handle));

        /// <summary>"lib:sitting", or a pose file.</summary>
        public NativePose Load(string name) => Checked(NativeMethods.ecorche_pose_load(Handle, NativeMethods.Utf8(name)));

        /// <summary>One anatomical angle, absolute.</summary>
        public NativePose SetAngle(string joint, string angle, double radians)
        {
            return Checked(NativeMethods.ecorche_pose_set_angle(Handle, NativeMethods.Utf8(joint), NativeMethods.Utf8(angle), radians));
        }

        /// <summary>The turn of a segment from the scan, in its joint's axes.</summary>
        public NativePose SetRotation(int segment, double x, double y, double z, double w)
        {
            return Checked(NativeMethods.ecorche_pose_set_rotation(Handle, (uint)segment, new[] { x, y, z, w }));
        }

        /// <summary>LPS mm.</summary>
        public NativePose SetRoot(double x, double y, double z) => Checked(NativeMethods.ecorche_pose_set_root(Handle, new[] { x, y, z }));

        private NativePose Checked(Code code)
        {
            NativeMethods.Check(code);
            return this;
        }

        public void Dispose()
        {
            NativeMethods.ecorche_pose_destroy(Handle);
            Handle = IntPtr.Zero;
            GC.SuppressFinalize(this);
        }

        ~NativePose() => NativeMethods.ecorche_pose_destroy(Handle);
    }
}
