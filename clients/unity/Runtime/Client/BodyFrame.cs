// SPDX-License-Identifier: Apache-2.0
using System;
using System.Runtime.InteropServices;
using Ecorche.Wire;

namespace Ecorche
{
    /// <summary>How far a pose can be believed (docs/reference/quality.md).</summary>
    public struct Quality
    {
        /// <summary>Else it is a warning.</summary>
        public bool Passes;
        public ulong InvertedTets;
        /// <summary>Of the volume, 0 to 1.</summary>
        public double InvertedShare;
        /// <summary>The least determinant of the deformation gradient; 1 is undeformed.</summary>
        public double MinDetF;
        /// <summary>Share of the volume at rest.</summary>
        public double VolumeChange;
        /// <summary>mm.</summary>
        public double BoneRigidity;
        /// <summary>mm: how much deeper than in the scan a bone lies in another one; NaN: a server that has just started has not looked yet.</summary>
        public double BoneOverlap;
        /// <summary>The pose that was measured.</summary>
        public ulong PoseSequence;

        internal static Quality From(PoseQuality told) => new Quality
        {
            Passes = told.Verdict == PoseQualityVerdict.Pass, InvertedTets = told.InvertedTets, InvertedShare = told.InvertedShare,
            MinDetF = told.MinDetF, VolumeChange = told.VolumeChange, BoneRigidity = told.BoneRigidity,
            BoneOverlap = told.OverlapPending ? double.NaN : told.HasOverlap ? told.Overlap.Mm : 0, PoseSequence = told.PoseSequence,
        };
    }

    /// <summary>The vertices of a tissue in a frame.</summary>
    public sealed class TissueVertices
    {
        /// <summary>Row of Body.Tissues.</summary>
        public int Tissue { get; internal set; }
        public int Count { get; internal set; }
        /// <summary>As the stream's layout says; there may be more bytes than `Count` vertices have.</summary>
        public byte[] Bytes { get; internal set; } = System.Array.Empty<byte>();

        /// <summary>Of <see cref="VertexLayout.Float"/>: x, y, z, and the normal's bits.</summary>
        public ReadOnlySpan<float> Floats => MemoryMarshal.Cast<byte, float>(Bytes).Slice(0, 4 * Count);

        /// <summary>Of <see cref="VertexLayout.Packed"/>: x, y, z and the normal.</summary>
        public ReadOnlySpan<ushort> Numbers => MemoryMarshal.Cast<byte, ushort>(Bytes).Slice(0, 4 * Count);

        internal void Need(int count, VertexLayout layout)
        {
            Count = count;
            // Of Packed four are written at once.
            int bytes = (count + 3) / 4 * 4 * Vertices.Size(layout);
            if (Bytes.Length < bytes) Bytes = new byte[bytes];
        }
    }

    /// <summary>One pose of all tissues of a stream. Its buffers are used again: it is yours until the stream's next <see cref="MeshStream.Take"/>.</summary>
    public sealed class BodyFrame
    {
        /// <summary>Which pose it shows; 0: the rest pose of a new session.</summary>
        public ulong PoseSequence { get; internal set; }
        /// <summary>Counts the poses of the session.</summary>
        public ulong Number { get; internal set; }
        /// <summary>What it shows of each tissue; of another level than the frame before there are other vertices and triangles.</summary>
        public MeshLevel Level { get; internal set; }
        public TissueVertices[] Tissues { get; internal set; } = System.Array.Empty<TissueVertices>();
        /// <summary>How the server wrote it: any frame may come as floats.</summary>
        public Encoding Encoding { get; internal set; }
        /// <summary>mm between numbers, of which positions are at most half off on each axis; 0: they are exact.</summary>
        public double Step { get; internal set; }
        /// <summary>Where number 0 lies, LPS mm.</summary>
        public Point3 Low { get; internal set; }
        /// <summary>The newest that was measured, perhaps of an older pose; default where none has been yet.</summary>
        public Quality Quality { get; internal set; }
        /// <summary>Joints that limits held back, as rows of Body.Segments.</summary>
        public int ClampedCount { get; private set; }
        /// <summary>Of a stream of motions: unit quaternion w, x, y, z and translation, LPS mm, of each segment from the scan.</summary>
        public double[] Motions { get; internal set; } = System.Array.Empty<double>();
        public Skinning Skinning { get; internal set; }

        private int[] _clamped = new int[4];

        public int Clamped(int row) => row < ClampedCount ? _clamped[row] : throw new ArgumentOutOfRangeException(nameof(row));

        internal void SetClamped(Repeated<ClampedJoint> joints)
        {
            ClampedCount = joints.Count;
            if (_clamped.Length < ClampedCount) _clamped = new int[2 * ClampedCount];
            for (int i = 0; i < ClampedCount; ++i) _clamped[i] = (int)joints[i].Joint;
        }

        /// <summary>What stands there for a tissue; null where the stream does not hold it.</summary>
        public TissueVertices Find(int tissue)
        {
            foreach (var one in Tissues)
                if (one.Tissue == tissue) return one;
            return null;
        }
    }
}
