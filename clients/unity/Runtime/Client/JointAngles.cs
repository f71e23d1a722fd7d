// SPDX-License-Identifier: Apache-2.0
using System;
using Ecorche.Wire;

namespace Ecorche
{
    /// <summary>Anatomical angles and turns of a joint: docs/reference/protocol.md, "Angles"; core/kinematics/angles.cpp decides.</summary>
    internal static class JointAngles
    {
        private const double GimbalLock = 1e-7;  // cosine of the middle angle

        /// <summary>turn(rest)^-1 turn(angles), in the joint's axes. Radians, in the order of its sequence.</summary>
        public static Turn Turn(Joint joint, double[] angles)
        {
            var rest = new double[3];
            for (int a = 0; a < Count(joint); ++a) rest[a] = joint.Sequence[a].Rest;
            return Intrinsic(joint, rest).Inverse * Intrinsic(joint, angles);
        }

        /// <summary>The angles of such a turn, radians; the middle one within a quarter turn. Zeros where the joint has no three.</summary>
        public static double[] Of(Joint joint, Turn turn)
        {
            var angles = new double[3];
            if (Count(joint) < 3) return angles;
            for (int a = 0; a < 3; ++a) angles[a] = joint.Sequence[a].Rest;
            var whole = Intrinsic(joint, angles) * turn;
            int i = (int)joint.Sequence[0].Axis, j = (int)joint.Sequence[1].Axis, k = (int)joint.Sequence[2].Axis;
            int e = (i + 1) % 3 == j ? 1 : -1;
            double cosine = Math.Sqrt(At(whole, i, i) * At(whole, i, i) + At(whole, i, j) * At(whole, i, j));
            double b = Math.Atan2(e * At(whole, i, k), cosine), a0, c;
            if (cosine > GimbalLock)
            {
                a0 = Math.Atan2(-e * At(whole, j, k), At(whole, k, k));
                c = Math.Atan2(-e * At(whole, i, j), At(whole, i, i));
            }
            else  // both turn about one line: leave the third at rest
            {
                c = Sign(joint, 2) * joint.Sequence[2].Rest;
                var first = whole * About(k, -c) * About(j, -b);
                a0 = Math.Atan2(e * At(first, k, j), At(first, j, j));
            }
            return new[] { Sign(joint, 0) * a0, Sign(joint, 1) * b, Sign(joint, 2) * c };
        }

        private static int Count(Joint joint) => Math.Min(joint.Sequence.Count, 3);

        private static int Sign(Joint joint, int a) => joint.Sequence[a].Negative ? -1 : 1;

        private static Turn Intrinsic(Joint joint, double[] angles)
        {
            var turn = Ecorche.Turn.None;
            for (int a = 0; a < Count(joint); ++a) turn *= About((int)joint.Sequence[a].Axis, Sign(joint, a) * angles[a]);
            return turn;
        }

        private static Turn About(int axis, double radians)
        {
            double half = radians / 2, s = Math.Sin(half);
            return new Turn(axis == 0 ? s : 0, axis == 1 ? s : 0, axis == 2 ? s : 0, Math.Cos(half));
        }

        /// <summary>Of the turn's matrix.</summary>
        private static double At(Turn q, int row, int column)
        {
            var v = new[] { q.x, q.y, q.z };
            if (row == column) return 1 - 2 * (v[(row + 1) % 3] * v[(row + 1) % 3] + v[(row + 2) % 3] * v[(row + 2) % 3]);
            int third = 3 - row - column, sense = (row + 1) % 3 == column ? -1 : 1;
            return 2 * (v[row] * v[column] + sense * q.w * v[third]);
        }
    }
}
