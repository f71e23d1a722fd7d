// SPDX-License-Identifier: Apache-2.0
using System;
using System.Runtime.InteropServices;
using Ecorche.Wire;

namespace Ecorche
{
    /// <summary>Where the numbers of skinned vertices stand: Low + Step * number, LPS mm.</summary>
    public struct PosedBox
    {
        public Point3 Low;
        public double Step;
    }

    /// <summary>Vertices of a tissue in a <see cref="SkinningTable"/>.</summary>
    public struct SkinnedTissue
    {
        /// <summary>Row of Body.Tissues.</summary>
        public int Tissue;
        public int First, Count;
    }

    /// <summary>What a stream of motions is skinned by, as skinning.hlsl reads it: all tissues in one row, first their vertices, then nodes.</summary>
    public sealed class SkinningTable
    {
        private const int PointBytes = 16, HungBytes = 36, Corners = 4, Whole = 65535;

        private readonly double[] _bounds;
        private readonly double _step;
        private readonly double[] _low;

        public SkinnedTissue[] Tissues { get; }
        public int VertexCount { get; }
        public int PointCount { get; }
        /// <summary>Of each point.</summary>
        public int Influences { get; }
        /// <summary>Four a point: x and y at rest, z and normal, x and y of the centre of rotation, z; the lower one first, 16 bits each.</summary>
        public uint[] Points { get; }
        /// <summary>Influences a point: segment, and weight in 65535ths above it.</summary>
        public uint[] Weights { get; }
        /// <summary>Of a vertex: 0, or 1 + its row of Hung.</summary>
        public uint[] HungRows { get; }
        /// <summary>Eight each: four rows of points, and the bits of four floats, their shares. At least one row.</summary>
        public uint[] Hung { get; }
        /// <summary>mm between the numbers at rest.</summary>
        public double Step => _step;
        /// <summary>How far off the server's vertices this is, mm, over the poses that it measured.</summary>
        public double LargestError { get; }

        internal SkinningTable(SkinningData told, FrameBytes from)
        {
            _step = told.Box.Step;
            _low = new double[] { told.Box.LowX, told.Box.LowY, told.Box.LowZ };
            if (!(_step > 0) || double.IsInfinity(_step)) throw EcorcheException.Damaged("skinning without its box");
            LargestError = told.LargestError;
            Tissues = new SkinnedTissue[told.Tissues.Count];
            long vertices = 0, points = 0, hung = 0;
            int influences = 1;
            for (int t = 0; t < Tissues.Length; ++t)
            {
                var one = told.Tissues[t];
                bool fits = one.Influences == 1 || one.Influences == 4 || one.Influences == 8;
                if (!fits || one.HungCount > one.Vertices || one.PointCount < one.Vertices || one.PointCount - one.Vertices > Corners * (long)one.HungCount)
                    throw EcorcheException.Damaged("skinning of tissue " + one.Tissue + " that cannot be");
                Tissues[t] = new SkinnedTissue { Tissue = (int)one.Tissue, First = (int)vertices, Count = (int)one.Vertices };
                vertices += one.Vertices;
                points += one.PointCount;
                hung += one.HungCount;
                influences = Math.Max(influences, (int)one.Influences);
            }
            if (points > int.MaxValue / 64) throw EcorcheException.Damaged("skinning of " + points + " points");
            (VertexCount, PointCount, Influences) = ((int)vertices, (int)points, influences);
            Points = new uint[4 * PointCount];
            Weights = new uint[Influences * PointCount];
            HungRows = new uint[VertexCount];
            Hung = new uint[8 * Math.Max(1, (int)hung)];
            int node = VertexCount, row = 0, segments = 0;
            for (int t = 0; t < Tissues.Length; ++t)
            {
                segments = Math.Max(segments, ReadPoints(told.Tissues[t], from, Tissues[t].First, node));
                row = ReadHung(told.Tissues[t], from, Tissues[t].First, node, row);
                node += (int)(told.Tissues[t].PointCount - told.Tissues[t].Vertices);
            }
            _bounds = Bounds(segments);
        }

        private static byte[] Unpack(Wire.Array array, uint count, int stride, FrameBytes from)
        {
            return count == 0 ? System.Array.Empty<byte>() : MeshoptVertices.Decode(from.Rows<byte>(array, ScalarType.U8, 1), (int)count, stride);
        }

        /// <summary>Returns how many segments are named.</summary>
        private int ReadPoints(TissueSkinning told, FrameBytes from, int first, int node)
        {
            int own = (int)told.Influences, stride = PointBytes + 4 * own, segments = 0;
            var rows = MemoryMarshal.Cast<byte, uint>(Unpack(told.Points, told.PointCount, stride, from));
            for (int p = 0; p < told.PointCount; ++p)
            {
                int to = p < told.Vertices ? first + p : node + p - (int)told.Vertices, at = p * stride / 4;
                for (int i = 0; i < 4; ++i) Points[4 * to + i] = rows[at + i];
                Points[4 * to + 1] ^= 0x80800000;  // as frames have it, packed
                long sum = 0;
                for (int k = 0; k < own; ++k)
                {
                    uint influence = rows[at + 4 + k];
                    Weights[Influences * to + k] = influence;
                    segments = Math.Max(segments, (int)(influence & 0xFFFF) + 1);
                    sum += influence >> 16;
                }
                // 0: of a vertex that hangs on others.
                if (sum != Whole && sum != 0) throw EcorcheException.Damaged("weights that sum to " + sum);
            }
            return segments;
        }

        private int ReadHung(TissueSkinning told, FrameBytes from, int first, int node, int row)
        {
            var rows = MemoryMarshal.Cast<byte, uint>(Unpack(told.Hung, told.HungCount, HungBytes, from));
            for (int h = 0; h < told.HungCount; ++h, ++row)
            {
                uint vertex = rows[9 * h];
                if (vertex >= told.Vertices) throw EcorcheException.Damaged("skinning hangs vertex " + vertex);
                HungRows[first + vertex] = (uint)row + 1;
                for (int c = 0; c < Corners; ++c)
                {
                    uint on = rows[9 * h + 1 + c];
                    if (on < told.Vertices || on >= told.PointCount) throw EcorcheException.Damaged("skinning hangs a vertex on row " + on);
                    Hung[8 * row + c] = (uint)node + on - told.Vertices;
                    Hung[8 * row + 4 + c] = rows[9 * h + 5 + c];
                }
            }
            return row;
        }

        /// <summary>Least and most of each segment's points at rest, mm.</summary>
        private double[] Bounds(int segments)
        {
            var bounds = new double[6 * segments];
            for (int i = 0; i < bounds.Length; ++i) bounds[i] = i % 6 < 3 ? double.PositiveInfinity : double.NegativeInfinity;
            for (int p = 0; p < PointCount; ++p)
            {
                for (int k = 0; k < Influences; ++k)
                {
                    uint influence = Weights[Influences * p + k];
                    if (influence >> 16 == 0) break;
                    int to = 6 * (int)(influence & 0xFFFF);
                    for (int axis = 0; axis < 3; ++axis)
                    {
                        double value = _low[axis] + _step * Number(p, axis);
                        bounds[to + axis] = Math.Min(bounds[to + axis], value);
                        bounds[to + 3 + axis] = Math.Max(bounds[to + 3 + axis], value);
                    }
                }
            }
            return bounds;
        }

        private uint Number(int point, int axis) => (Points[4 * point + axis / 2] >> (axis == 1 ? 16 : 0)) & 0xFFFF;

        /// <summary>A pose as skinning.hlsl reads it: `rows` has eight floats a segment, quaternion x, y, z, w, where it takes the middle of the box at
        /// rest from `low`, mm, and 0. Returns the box that the posed numbers stand in, so large that nothing is clamped.</summary>
        public PosedBox Place(double[] motions, float[] rows)
        {
            var box = Box(motions);
            var low = box.Low;
            double middle = 32768 * _step;
            for (int s = 0; s < motions.Length / 7; ++s)
            {
                var (x, y, z) = Moved(motions, s, _low[0] + middle, _low[1] + middle, _low[2] + middle);
                for (int c = 0; c < 3; ++c) rows[8 * s + c] = (float)motions[7 * s + 1 + c];
                rows[8 * s + 3] = (float)motions[7 * s];
                rows[8 * s + 4] = (float)(x - low.x);
                rows[8 * s + 5] = (float)(y - low.y);
                rows[8 * s + 6] = (float)(z - low.z);
            }
            return box;
        }

        private PosedBox Box(double[] motions)
        {
            var (x0, y0, z0) = (double.PositiveInfinity, double.PositiveInfinity, double.PositiveInfinity);
            var (x1, y1, z1) = (double.NegativeInfinity, double.NegativeInfinity, double.NegativeInfinity);
            for (int s = 0; s < motions.Length / 7 && 6 * s < _bounds.Length; ++s)
            {
                if (!(_bounds[6 * s] <= _bounds[6 * s + 3])) continue;
                for (int corner = 0; corner < 8; ++corner)
                {
                    var (x, y, z) = Moved(motions, s, _bounds[6 * s + (corner & 1) * 3], _bounds[6 * s + 1 + (corner >> 1 & 1) * 3],
                        _bounds[6 * s + 2 + (corner >> 2) * 3]);
                    (x0, y0, z0) = (Math.Min(x0, x), Math.Min(y0, y), Math.Min(z0, z));
                    (x1, y1, z1) = (Math.Max(x1, x), Math.Max(y1, y), Math.Max(z1, z));
                }
            }
            if (!(x0 <= x1)) return new PosedBox { Step = 1 };
            // A blend of motions may lead a little beyond what each makes of its points.
            double extent = 1.2 * Math.Max(Math.Max(1, x1 - x0), Math.Max(y1 - y0, z1 - z0));
            return new PosedBox { Low = new Point3((x0 + x1 - extent) / 2, (y0 + y1 - extent) / 2, (z0 + z1 - extent) / 2), Step = extent / Whole };
        }

        private static (double x, double y, double z) Moved(double[] motions, int segment, double x, double y, double z)
        {
            int at = 7 * segment;
            double w = motions[at], a = motions[at + 1], b = motions[at + 2], c = motions[at + 3];
            double tx = 2 * (b * z - c * y), ty = 2 * (c * x - a * z), tz = 2 * (a * y - b * x);
            return (x + w * tx + b * tz - c * ty + motions[at + 4], y + w * ty + c * tx - a * tz + motions[at + 5],
                z + w * tz + a * ty - b * tx + motions[at + 6]);
        }
    }
}
