// SPDX-License-Identifier: Apache-2.0
using System;

namespace Ecorche
{
    /// <summary>A plane of pixels through the posed body, LPS mm.</summary>
    public sealed class SlicePlane
    {
        /// <param name="origin">The centre of the first pixel.</param>
        /// <param name="u">From a pixel to the next of its row.</param>
        /// <param name="v">From a row to the next, perpendicular to `u`.</param>
        /// <param name="sizeU">Pixels of a row, 1 to 4096.</param>
        /// <param name="sizeV">Rows, 1 to 4096.</param>
        /// <exception cref="ArgumentOutOfRangeException">A size that no slice has.</exception>
        public SlicePlane(Point3 origin, Point3 u, Point3 v, int sizeU, int sizeV)
        {
            if (sizeU < 1 || sizeU > Most) throw new ArgumentOutOfRangeException(nameof(sizeU), sizeU, "give 1 to " + Most + " pixels");
            if (sizeV < 1 || sizeV > Most) throw new ArgumentOutOfRangeException(nameof(sizeV), sizeV, "give 1 to " + Most + " pixels");
            (Origin, U, V, SizeU, SizeV) = (origin, u, v, sizeU, sizeV);
        }

        public Point3 Origin { get; }
        public Point3 U { get; }
        public Point3 V { get; }
        public int SizeU { get; }
        public int SizeV { get; }

        private const int Most = 4096;
    }
}
