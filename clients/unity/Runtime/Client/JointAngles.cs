// SPDX-License-Identifier: Apache-2.0
using System;
using Ecorche.Wire;

namespace Ecorche
{
    /// <summary>Anatomical angles and turns of a joint: docs/reference/protocol.md, "Angles"; core/kinematics/angles.cpp decides.</summary>
    internal static class JointAngles
    {
        private const double GimbalLock = 1e-7;  // cosine of the middle angle

        /// <summary>turn(rest)^-1 turn(angles), in the joint's axes. Radians, in the order of its sequence. Allocates nothing.</summary>
        public static Turn Turn(Joint joint, double first, double second, double third)
        {
            return Rest(joint).Inverse * Intrinsic(joint, first, second, third);
        }

        /// <summary>An angle of such a turn, radians; the middle one within a quarter turn. 0 where the joint has no three. Allocates nothing.</summary>
        public static double Of(Joint joint, Turn turn, int angle)
        {
            if (joint.Sequence.Count < 3) return 0;
            var whole = Rest(joint) * turn;
            int i = (int)joint.Sequence[0].Axis, j = (int)joint.Sequence[1].Axis, k = (int)joint.Sequence[2].Axis;
            int e = (i + 1) % 3 == j ? 1 : -1;
            double cosine = Math.Sqrt(At(whole, i, i) * At(whole, i, i) + At(whole, i, j) * At(whole, i, j));
            double b = Math.Atan2(e * At(whole, i, k), cosine), a, c;
            if (cosine > GimbalLock)
            {
                a = Math.Atan2(-e * At(whole, j, k), At(whole, k, k));
                c = Math.Atan2(-e * At(whole, i, j), At(whole, i, i));
            }
            else  // both turn about one line: leave the third at rest
            {
                c = Sign(joint, 2) * joint.Sequence[2].Rest;
                var first = whole * About(k, -c) * About(j, -b);
                a = Math.Atan2(e * At(first, k, j), At(first, j, j));
            }
            return Sign(joint, angle) * (angle == 0 ? a : angle == 1 ? b : c);
        }

        private static int Sign(Joint joint, int a) => joint.Sequence[a].Negative ? -1 : 1;

        private static double RestOf(Joint joint, int a) => a < joint.Sequence.Count ? joint.Sequence[a].Rest : 0;

        private static Turn Rest(Joint joint) => Intrinsic(joint, RestOf(joint, 0), RestOf(joint, 1), RestOf(joint, 2));

        private static Turn Intrinsic(Joint joint, double first, double second, double third)
        {
            var turn = Ecorche.Turn.None;
            for (int a = 0; a < joint.Sequence.Count && a < 3; ++a)
                turn *= About((int)joint.Sequence[a].Axis, Sign(joint, a) * (a == 0 ? first : a == 1 ? second : third));
            return turn;
        }

        private static Turn About(int axis, double radians)
        {
            double half = radians / 2, s = Math.Sin(half);
            return new Turn(axis == 0 ? s : 0, axis == 1 ? s : 0, axis == 2 ? s : 0, Math.Cos(half));
        }

        private static double Part(Turn q, int axis) => axis == 0 ? q.x : axis == 1 ? q.y : q.z;

        /// <summary>Of the turn's matrix.</summary>
        private static double At(Turn q, int row, int column)
        {
            double next = Part(q, (row + 1) % 3), last = Part(q, (row + 2) % 3);
            if (row == column) return 1 - 2 * (next * next + last * last);
            int sense = (row + 1) % 3 == column ? -1 : 1;
            return 2 * (Part(q, row) * Part(q, column) + sense * q.w * Part(q, 3 - row - column));
        }
    }
}
