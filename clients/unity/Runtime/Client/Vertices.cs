// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;

namespace Ecorche
{
    /// <summary>How vertices lie in memory, ready for a graphics card.</summary>
    public enum VertexLayout
    {
        /// <summary>
        /// 8 bytes: u16 x, y, z as the server numbers them, and an octahedral normal (its low byte u + 128, its high byte v + 128, in 127ths; 0: none).
        /// Position = BodyFrame.Low + BodyFrame.Step * number, LPS mm, whatever the space.
        /// </summary>
        Packed,
        /// <summary>16 bytes: three floats in the stream's space, and the unit normal as four i8 in 127ths, the fourth 0.</summary>
        Float,
    }

    /// <summary>Writes vertices from numbers by axis, or from floats.</summary>
    internal static unsafe class Vertices
    {
        private static readonly Dictionary<Space, uint[]> Tables = new Dictionary<Space, uint[]>();

        public static int Size(VertexLayout layout) => layout == VertexLayout.Packed ? 8 : 16;

        /// <summary>`out` has room for a multiple of four; `normals`, the protocol's, may be null, and may be read up to one.</summary>
        public static void Pack(ushort* x, ushort* y, ushort* z, ushort* normals, int count, ulong* to)
        {
            const ulong second = 0xFFFF0000, third = 0xFFFF00000000, fourth = 0xFFFF000000000000;
            for (int i = 0; i < count; i += 4)
            {
                ulong a = *(ulong*)(x + i), b = *(ulong*)(y + i), c = *(ulong*)(z + i);
                ulong n = normals == null ? 0 : *(ulong*)(normals + i) ^ 0x8080808080808080;
                to[i] = (a & 0xFFFF) | ((b << 16) & second) | ((c << 32) & third) | (n << 48);
                to[i + 1] = ((a >> 16) & 0xFFFF) | (b & second) | ((c << 16) & third) | ((n << 32) & fourth);
                to[i + 2] = ((a >> 32) & 0xFFFF) | ((b >> 16) & second) | (c & third) | ((n << 16) & fourth);
                to[i + 3] = (a >> 48) | ((b >> 32) & second) | ((c >> 16) & third) | (n & fourth);
            }
        }

        /// <summary>Numbers by axis into floats, each position computed in double precision.</summary>
        public static void Place(ushort* x, ushort* y, ushort* z, ushort* normals, int count, in Placing by, uint* table, float* to)
        {
            ushort* first = by.From0 == 0 ? x : by.From0 == 1 ? y : z;
            ushort* second = by.From1 == 0 ? x : by.From1 == 1 ? y : z;
            ushort* third = by.From2 == 0 ? x : by.From2 == 1 ? y : z;
            double s0 = by.Scale0, s1 = by.Scale1, s2 = by.Scale2, o0 = by.Offset0, o1 = by.Offset1, o2 = by.Offset2;
            if (normals == null)
            {
                for (float* end = to + 4 * count; to < end; ++first, ++second, ++third, to += 4)
                {
                    to[0] = (float)(o0 + s0 * *first);
                    to[1] = (float)(o1 + s1 * *second);
                    to[2] = (float)(o2 + s2 * *third);
                    *(uint*)(to + 3) = 0;
                }
                return;
            }
            for (float* end = to + 4 * (count & ~3); to < end; first += 4, second += 4, third += 4, normals += 4, to += 16)
            {
                to[0] = (float)(o0 + s0 * first[0]);
                to[1] = (float)(o1 + s1 * second[0]);
                to[2] = (float)(o2 + s2 * third[0]);
                *(uint*)(to + 3) = table[normals[0]];
                to[4] = (float)(o0 + s0 * first[1]);
                to[5] = (float)(o1 + s1 * second[1]);
                to[6] = (float)(o2 + s2 * third[1]);
                *(uint*)(to + 7) = table[normals[1]];
                to[8] = (float)(o0 + s0 * first[2]);
                to[9] = (float)(o1 + s1 * second[2]);
                to[10] = (float)(o2 + s2 * third[2]);
                *(uint*)(to + 11) = table[normals[2]];
                to[12] = (float)(o0 + s0 * first[3]);
                to[13] = (float)(o1 + s1 * second[3]);
                to[14] = (float)(o2 + s2 * third[3]);
                *(uint*)(to + 15) = table[normals[3]];
            }
            for (float* end = to + 4 * (count & 3); to < end; ++first, ++second, ++third, ++normals, to += 4)
            {
                to[0] = (float)(o0 + s0 * *first);
                to[1] = (float)(o1 + s1 * *second);
                to[2] = (float)(o2 + s2 * *third);
                *(uint*)(to + 3) = table[*normals];
            }
        }

        /// <summary>Positions of three floats, LPS mm, likewise.</summary>
        public static void Place(float* positions, ushort* normals, int count, in Placing by, uint* table, float* to)
        {
            float* from = positions;
            for (int i = 0; i < count; ++i, from += 3, to += 4)
            {
                to[0] = (float)(by.Scale0 * from[by.From0]);
                to[1] = (float)(by.Scale1 * from[by.From1]);
                to[2] = (float)(by.Scale2 * from[by.From2]);
            }
            WriteNormals(normals, count, table, (uint*)to - 4 * count);
        }

        private static void WriteNormals(ushort* normals, int count, uint* table, uint* to)
        {
            if (normals == null)
                for (int i = 0; i < count; ++i) to[4 * i + 3] = 0;
            else
                for (int i = 0; i < count; ++i) to[4 * i + 3] = table[normals[i]];
        }

        /// <summary>Positions of three floats to numbers of a cube.</summary>
        public static void Number(float* positions, int count, double low0, double low1, double low2, double step, ushort* x, ushort* y, ushort* z)
        {
            double steps = 1 / step;
            for (int i = 0; i < count; ++i)
            {
                x[i] = (ushort)((positions[3 * i] - low0) * steps + 0.5);
                y[i] = (ushort)((positions[3 * i + 1] - low1) * steps + 0.5);
                z[i] = (ushort)((positions[3 * i + 2] - low2) * steps + 0.5);
            }
        }

        /// <summary>Three numbers each, by axis.</summary>
        public static void Part(ushort* numbers, int count, ushort* x, ushort* y, ushort* z)
        {
            for (int i = 0; i < count; ++i)
            {
                x[i] = numbers[3 * i];
                y[i] = numbers[3 * i + 1];
                z[i] = numbers[3 * i + 2];
            }
        }

        /// <summary>Every "oct16" of the protocol as four i8 in the space. Made once a space.</summary>
        public static uint[] Normals(Space space)
        {
            lock (Tables)
            {
                if (Tables.TryGetValue(space, out var table)) return table;
                table = new uint[65536];
                var axes = Axes.Of(space);
                for (int code = 0; code < table.Length; ++code) table[code] = code == 0x8080 ? 0 : Bytes(Normal((sbyte)code, (sbyte)(code >> 8)), axes);
                return Tables[space] = table;
            }
        }

        /// <summary>docs/reference/protocol.md, "Encodings": u and v in 127ths.</summary>
        private static Point3 Normal(sbyte first, sbyte second)
        {
            double u = first / 127.0, v = second / 127.0, z = 1 - Math.Abs(u) - Math.Abs(v);
            double x = z < 0 ? (1 - Math.Abs(v)) * (u < 0 ? -1 : 1) : u, y = z < 0 ? (1 - Math.Abs(u)) * (v < 0 ? -1 : 1) : v;
            double length = Math.Sqrt(x * x + y * y + z * z);
            return new Point3(x / length, y / length, z / length);
        }

        private static uint Bytes(Point3 normal, Axes axes)
        {
            var turned = axes.Point(normal.x, normal.y, normal.z);
            double most = 127 / axes.Scale;
            return Byte(most * turned.x) | Byte(most * turned.y) << 8 | Byte(most * turned.z) << 16;
        }

        private static uint Byte(double value) => (byte)(sbyte)Math.Round(value);
    }

    /// <summary>out[r] = Offset[r] + Scale[r] * in[From[r]].</summary>
    internal struct Placing
    {
        public int From0, From1, From2;
        public double Scale0, Scale1, Scale2, Offset0, Offset1, Offset2;

        public Placing(Axes axes, double low0, double low1, double low2, double step)
        {
            From0 = axes.From(0);
            From1 = axes.From(1);
            From2 = axes.From(2);
            (Scale0, Scale1, Scale2) = (axes.Sign(0) * axes.Scale * step, axes.Sign(1) * axes.Scale * step, axes.Sign(2) * axes.Scale * step);
            var low = axes.Point(low0, low1, low2);
            (Offset0, Offset1, Offset2) = (low.x, low.y, low.z);
        }
    }
}
