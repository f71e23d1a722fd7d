// SPDX-License-Identifier: Apache-2.0
using System;
using System.Runtime.InteropServices;

namespace Ecorche.Native
{
    /// <summary>Numbers of ecorche_skinning, which are not those of the wire.</summary>
    public enum NativeSkinning
    {
        Lbs = 0,
        Dqs = 1,
        Cor = 2,
    }

    /// <summary>A posed body and all its buffers. For one thread at a time.</summary>
    public sealed class NativeBody : IDisposable
    {
        private const int VertexBytes = 24;
        private IntPtr _handle;

        /// <summary>`threads` that pose it; 0: one a processor.</summary>
        public NativeBody(NativeModel model, bool normals = true, int threads = 0)
        {
            var options = new NativeMethods.BodyOptions
            {
                StructSize = NativeMethods.SizeOf<NativeMethods.BodyOptions>(), Normals = normals ? 1 : 0, Threads = (uint)threads,
            };
            NativeMethods.Check(NativeMethods.ecorche_body_create(model.Handle, ref options, out _handle));
        }

        /// <summary>Poses the tissues whose rows are in `tissues`, ascending (null: all). Allocates nothing.</summary>
        public NativeBody Update(NativePose pose, NativeSkinning skinning = NativeSkinning.Cor, uint[] tissues = null)
        {
            NativeMethods.Check(NativeMethods.ecorche_body_update(_handle, pose.Handle, (int)skinning, tissues, (UIntPtr)(tissues?.Length ?? 0)));
            return this;
        }

        /// <summary>Into vertices of six floats, position and normal, in the space: what SetVertexBufferData takes. Allocates nothing.</summary>
        public unsafe void Copy(int tissue, Space space, float[] vertices)
        {
            fixed (float* to = vertices)
            {
                var size = (UIntPtr)VertexBytes;
                NativeMethods.Check(NativeMethods.ecorche_body_copy(_handle, (uint)tissue, space, (IntPtr)to, size, (IntPtr)(to + 3), size,
                    (UIntPtr)(vertices.Length / 6)));
            }
        }

        /// <summary>Of the last update. `sampled`: on 8192 tets, in a fraction of a frame.</summary>
        public Quality Measure(bool sampled = true)
        {
            var told = new NativeMethods.Quality { StructSize = NativeMethods.SizeOf<NativeMethods.Quality>() };
            NativeMethods.Check(NativeMethods.ecorche_body_measure(_handle, sampled ? 1 : 0, ref told));
            return new Quality
            {
                Passes = told.Pass != 0, InvertedTets = told.InvertedTets, InvertedShare = told.InvertedShare, MinDetF = told.MinDetF,
                VolumeChange = told.VolumeChange, BoneRigidity = told.BoneRigidity, BoneOverlap = told.BoneOverlap,
            };
        }

        /// <summary>Points (three each, LPS mm) of the posed body back to the scan, or the other way; NaN outside. `tissues`: what holds each in the scan.</summary>
        public unsafe float[] Probe(float[] points, bool toRest = true, int[] tissues = null)
        {
            if (tissues != null && 3 * tissues.Length < points.Length)
                throw new EcorcheException(Code.InvalidArgument, "tissues: has less rows than there are points");
            var found = new float[points.Length];
            fixed (float* to = found)
            fixed (int* held = tissues)
            {
                var probed = new NativeMethods.Probed { StructSize = NativeMethods.SizeOf<NativeMethods.Probed>(), Points = (IntPtr)to, Tissues = (IntPtr)held };
                var count = (UIntPtr)(points.Length / 3);
                NativeMethods.Check(toRest ? NativeMethods.ecorche_body_posed_to_rest(_handle, points, count, ref probed)
                    : NativeMethods.ecorche_body_rest_to_posed(_handle, points, count, ref probed));
            }
            return found;
        }

        public void Dispose()
        {
            NativeMethods.ecorche_body_destroy(_handle);
            _handle = IntPtr.Zero;
            GC.SuppressFinalize(this);
        }

        ~NativeBody() => NativeMethods.ecorche_body_destroy(_handle);
    }
}
