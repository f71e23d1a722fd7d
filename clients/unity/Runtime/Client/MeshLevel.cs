// SPDX-License-Identifier: Apache-2.0
using System;
using Ecorche.Wire;

namespace Ecorche
{
    /// <summary>What frames of a level of detail hold of a tissue.</summary>
    public sealed class MeshPart
    {
        /// <summary>Row of Body.Tissues.</summary>
        public int Tissue { get; internal set; }
        public int VertexCount { get; internal set; }
        /// <summary>Three corners each, wound as the stream's space wants them.</summary>
        public int[] Triangles { get; internal set; }
        /// <summary>Which vertices of the whole tissue these are; null: all.</summary>
        public int[] Rows { get; internal set; }

        /// <summary>The numbers of the last keyframe: x, then y, then z, <see cref="Stride"/> apart.</summary>
        internal ushort[] Key;

        internal int Stride => (VertexCount + 31) / 32 * 32;
    }

    /// <summary>A level of detail of a stream, or its region: 0 is the finest.</summary>
    public sealed class MeshLevel
    {
        public int Level { get; internal set; }
        /// <summary>By ascending tissues.</summary>
        public MeshPart[] Parts { get; internal set; }

        /// <summary>The frame that is the keyframe; 0 where none came.</summary>
        internal ulong Keyframe;
        internal bool HasKeyframe;

        internal static MeshLevel Whole(Body body, Repeated<string> names, Axes axes)
        {
            int count = 0;
            var chosen = new bool[body.Tissues.Count];
            for (int row = 0; row < chosen.Length; ++row)
            {
                chosen[row] = names.Count == 0 || names.Span.IndexOf(body.Tissues[row].Name) >= 0;
                if (chosen[row]) ++count;
            }
            var parts = new MeshPart[count];
            for (int row = 0, at = 0; row < chosen.Length; ++row)
            {
                if (!chosen[row]) continue;
                var triangles = (int[])body.Triangles(row).Clone();
                axes.Wind(triangles);
                parts[at++] = new MeshPart { Tissue = row, VertexCount = (int)body.Tissues[row].Vertices, Triangles = triangles };
            }
            return new MeshLevel { Parts = parts };
        }

        internal static MeshLevel Read(Wire.MeshLevel told, FrameBytes from, Body body, Axes axes)
        {
            var parts = new MeshPart[told.Parts.Count];
            for (int i = 0; i < parts.Length; ++i)
            {
                var part = told.Parts[i];
                if (part.Tissue >= body.Tissues.Count || i > 0 && part.Tissue <= parts[i - 1].Tissue)
                    throw EcorcheException.Damaged("a level has tissues that the model has not, or not in its order");
                var rows = Rows(from.Rows<uint>(part.Vertices, ScalarType.U32, 1), body.Tissues[(int)part.Tissue].Vertices);
                var triangles = Rows(from.Rows<uint>(part.Triangles, ScalarType.U32, 3), (ulong)rows.Length);
                axes.Wind(triangles);
                parts[i] = new MeshPart { Tissue = (int)part.Tissue, VertexCount = rows.Length, Triangles = triangles, Rows = rows };
            }
            return new MeshLevel { Level = (int)told.Level, Parts = parts };
        }

        /// <summary>Rows of `count` things.</summary>
        internal static int[] Rows(ReadOnlySpan<uint> from, ulong count)
        {
            var rows = new int[from.Length];
            for (int i = 0; i < rows.Length; ++i)
            {
                if (from[i] >= count) throw EcorcheException.Damaged("a row goes beyond its " + count + " vertices");
                rows[i] = (int)from[i];
            }
            return rows;
        }
    }
}
