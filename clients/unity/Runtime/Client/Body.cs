// SPDX-License-Identifier: Apache-2.0
using System;
using Ecorche.Wire;

namespace Ecorche
{
    /// <summary>What a server told of a model: all that does not change with the pose.</summary>
    public sealed class Body
    {
        private readonly ModelOpened _opened;
        private readonly int[][] _triangles;

        internal Body(ModelOpened opened, FrameBytes from)
        {
            _opened = opened;
            if (opened.Skeleton.Segments.Count == 0) throw EcorcheException.Damaged("a model without a skeleton");
            for (int s = 0; s < opened.Skeleton.Segments.Count; ++s)
                if (opened.Skeleton.Segments[s].Parent >= s) throw EcorcheException.Damaged("a segment stands before its parent");
            _triangles = new int[opened.Tissues.Count][];
            for (int t = 0; t < _triangles.Length; ++t)
            {
                var tissue = opened.Tissues[t];
                if (tissue.Vertices > int.MaxValue / 16) throw EcorcheException.Damaged("a tissue of " + tissue.Vertices + " vertices");
                _triangles[t] = MeshLevel.Rows(from.Rows<uint>(tissue.Triangles, ScalarType.U32, 3), tissue.Vertices);
            }
        }

        public string Model => _opened.Model;

        /// <summary>By which others may join.</summary>
        public string Session => _opened.Session;

        /// <summary>Skin first, then the bones, then the others.</summary>
        public Repeated<Tissue> Tissues => _opened.Tissues;

        /// <summary>Parents first; row 0 is the root.</summary>
        public Repeated<Segment> Segments => _opened.Skeleton.Segments;

        public Repeated<Volume> Volumes => _opened.Volumes;

        internal ulong RigDigest => _opened.RigDigest;
        internal ulong TopologyDigest => _opened.TopologyDigest;
        internal ModelOpened Opened => _opened;

        /// <summary>Three corners each, rows of the tissue's vertices, counter-clockwise seen from outside in LPS.</summary>
        public int[] Triangles(int tissue) => _triangles[tissue];

        /// <summary>The row of a name; -1 where there is none.</summary>
        public int FindTissue(string name)
        {
            for (int t = 0; t < Tissues.Count; ++t)
                if (Tissues[t].Name == name) return t;
            return -1;
        }

        /// <summary>The row of a segment's, a joint's, or a motion file's name of it; -1 where there is none.</summary>
        public int FindSegment(string name)
        {
            for (int s = 0; s < Segments.Count; ++s)
                if (Segments[s].Name == name || Segments[s].Joint.Name == name) return s;
            for (int s = 0; s < Segments.Count; ++s)
                for (int a = 0; a < Segments[s].Aliases.Count; ++a)
                    if (string.Equals(Segments[s].Aliases[a], name, StringComparison.OrdinalIgnoreCase)) return s;
            return -1;
        }
    }
}
