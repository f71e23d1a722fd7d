// SPDX-License-Identifier: Apache-2.0
namespace Ecorche
{
    /// <summary>A point or a direction in double precision.</summary>
    public struct Point3
    {
        public double x, y, z;

        public Point3(double x, double y, double z)
        {
            this.x = x;
            this.y = y;
            this.z = z;
        }
    }

    /// <summary>A rotation: a unit quaternion.</summary>
    public struct Turn
    {
        public double x, y, z, w;

        public Turn(double x, double y, double z, double w)
        {
            this.x = x;
            this.y = y;
            this.z = z;
            this.w = w;
        }

        public static Turn None => new Turn(0, 0, 0, 1);

        public Turn Inverse => new Turn(-x, -y, -z, w);

        /// <summary>First b, then a.</summary>
        public static Turn operator *(Turn a, Turn b)
        {
            return new Turn(a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z);
        }
    }
}
