// SPDX-License-Identifier: Apache-2.0
namespace Ecorche
{
    /// <summary>Where a program has its points; the same as ecorche_space of the C libraries. The patient faces the way that a character faces.</summary>
    public enum Space
    {
        /// <summary>ecorche's own: x left, y back, z up; right-handed, mm.</summary>
        LpsMm = 0,
        /// <summary>x right, y up, z forward; left-handed, m.</summary>
        Unity = 1,
        /// <summary>x forward, y right, z up; left-handed, cm.</summary>
        Unreal = 2,
        /// <summary>Also OpenXR: x left of who faces +z, y up; right-handed, m.</summary>
        Gltf = 3,
        /// <summary>REP 103: x forward, y left, z up; right-handed, m.</summary>
        Ros = 4,
        /// <summary>OpenIGTLink, 3D Slicer: x right, y front, z up; right-handed, mm.</summary>
        RasMm = 5,
    }

    /// <summary>From LPS mm into a space and back. Each axis of a space is one of LPS, perhaps turned round.</summary>
    public sealed class Axes
    {
        private static readonly Axes[] All =
        {
            new Axes(new[] { 0, 1, 2 }, new[] { 1, 1, 1 }, 1), new Axes(new[] { 0, 2, 1 }, new[] { -1, 1, -1 }, 1e-3, true),
            new Axes(new[] { 1, 0, 2 }, new[] { -1, -1, 1 }, 0.1), new Axes(new[] { 0, 2, 1 }, new[] { 1, 1, -1 }, 1e-3),
            new Axes(new[] { 1, 0, 2 }, new[] { -1, 1, 1 }, 1e-3), new Axes(new[] { 0, 1, 2 }, new[] { -1, -1, 1 }, 1),
        };

        private readonly int[] _from, _sign;
        private readonly bool _clockwise;

        private Axes(int[] from, int[] sign, double scale, bool clockwise = false)
        {
            _from = from;
            _sign = sign;
            _clockwise = clockwise;
            Scale = scale;
            // Two axes that change places mirror, and so does each that is turned round.
            bool swapped = from[0] != 0 || from[1] != 1;
            Mirrors = swapped != (sign[0] * sign[1] * sign[2] < 0);
        }

        public static Axes Of(Space space) => All[(int)space];

        /// <summary>Units a millimetre.</summary>
        public double Scale { get; }

        /// <summary>The space is left-handed: rotations turn the other way round.</summary>
        public bool Mirrors { get; }

        /// <summary>Which axis of LPS lies along `axis`, and whether it points the same way (1) or not (-1).</summary>
        public int From(int axis) => _from[axis];

        public int Sign(int axis) => _sign[axis];

        public Point3 Point(double x, double y, double z)
        {
            return new Point3(Scale * Turned(0, x, y, z), Scale * Turned(1, x, y, z), Scale * Turned(2, x, y, z));
        }

        /// <summary>Into LPS mm: what a probe takes.</summary>
        public Point3 PointBack(double x, double y, double z)
        {
            return new Point3(Back(0, x, y, z) / Scale, Back(1, x, y, z) / Scale, Back(2, x, y, z) / Scale);
        }

        /// <summary>A rotation, as unit quaternion, of LPS into the space: seen in a mirror it turns the other way.</summary>
        public Turn Rotation(Turn turn)
        {
            int sense = Mirrors ? -1 : 1;
            double x = sense * turn.x, y = sense * turn.y, z = sense * turn.z;
            return new Turn(Turned(0, x, y, z), Turned(1, x, y, z), Turned(2, x, y, z), turn.w);
        }

        /// <summary>And of the space into LPS.</summary>
        public Turn RotationBack(Turn turn)
        {
            int sense = Mirrors ? -1 : 1;
            double x = sense * turn.x, y = sense * turn.y, z = sense * turn.z;
            return new Turn(Back(0, x, y, z), Back(1, x, y, z), Back(2, x, y, z), turn.w);
        }

        /// <summary>Three corners each, counter-clockwise as seen from outside. That is the front everywhere but in Unity, where it is clockwise.</summary>
        internal void Wind(int[] triangles)
        {
            if (!_clockwise) return;
            for (int i = 0; i + 2 < triangles.Length; i += 3)
            {
                int corner = triangles[i + 1];
                triangles[i + 1] = triangles[i + 2];
                triangles[i + 2] = corner;
            }
        }

        private double Turned(int axis, double x, double y, double z) => _sign[axis] * Pick(_from[axis], x, y, z);

        private double Back(int axis, double x, double y, double z)
        {
            int row = System.Array.IndexOf(_from, axis);
            return _sign[row] * Pick(row, x, y, z);
        }

        private static double Pick(int row, double x, double y, double z) => row == 0 ? x : row == 1 ? y : z;
    }
}
