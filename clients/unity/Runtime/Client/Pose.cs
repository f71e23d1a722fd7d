// SPDX-License-Identifier: Apache-2.0
using System;
using Ecorche.Wire;

namespace Ecorche
{
    /// <summary>How every joint is turned from the scan. What limits and couplings make of it decides the server.</summary>
    public sealed class Pose
    {
        /// <summary>What a joint may call an angle instead, and its sign (core/kinematics/named_angles.cpp).</summary>
        private static readonly (string a, string b, int sign)[] Equivalents =
        {
            ("adduction", "abduction", -1), ("eversion", "inversion", -1), ("depression", "elevation", -1), ("dorsiflexion", "flexion", -1),
            ("dorsiflexion", "plantarflexion", -1), ("lateral_bending", "bending", 1),
        };

        private readonly Body _body;
        private readonly double[] _angles;

        /// <summary>As scanned.</summary>
        public Pose(Body body)
        {
            _body = body;
            _angles = new double[3 * body.Segments.Count];
            Rotation = new double[4 * body.Segments.Count];
            Reset();
        }

        /// <summary>Four for each segment, w, x, y, z: the turn from the scan in its joint's axes, a unit quaternion.</summary>
        public double[] Rotation { get; }

        /// <summary>Where the whole body goes from the scan: LPS mm.</summary>
        public Point3 Root { get; set; }

        public Skinning Skinning { get; set; } = Skinning.Cor;

        public void Reset()
        {
            Root = default;
            for (int s = 0; s < _body.Segments.Count; ++s)
            {
                SetRotation(s, Turn.None);
                var sequence = _body.Segments[s].Joint.Sequence;
                for (int a = 0; a < 3 && a < sequence.Count; ++a) _angles[3 * s + a] = sequence[a].Rest;
            }
        }

        /// <summary>One anatomical angle, absolute, radians: "elbow_left", "flexion", or what the joint calls the opposite. Its others stay.</summary>
        /// <remarks>After SetRotation of the same joint its others are those before.</remarks>
        /// <exception cref="EcorcheException">NotFound: the model has no such angle. InvalidArgument: not finite.</exception>
        public Pose SetAngle(string joint, string angle, double radians)
        {
            if (double.IsNaN(radians) || double.IsInfinity(radians)) throw new EcorcheException(Code.InvalidArgument, "radians: is not finite");
            for (int s = 0; s < _body.Segments.Count; ++s)
            {
                var found = _body.Segments[s].Joint;
                if (found.Name != joint) continue;
                int sign = 1, place = Find(found, angle);
                for (int e = 0; e < Equivalents.Length && place < 0; ++e)
                {
                    var (a, b, turned) = Equivalents[e];
                    if (a != angle && b != angle) continue;
                    place = Find(found, a == angle ? b : a);
                    sign = turned;
                }
                if (place < 0) break;
                _angles[3 * s + place] = sign * radians;
                Bend(s, found);
                return this;
            }
            throw new EcorcheException(Code.NotFound, joint + "." + angle + ": the model has no such angle (ecorche info lists them)");
        }

        /// <summary>The turn of a segment from the scan, in its joint's axes.</summary>
        public Pose SetRotation(int segment, Turn turn)
        {
            Rotation[4 * segment] = turn.w;
            Rotation[4 * segment + 1] = turn.x;
            Rotation[4 * segment + 2] = turn.y;
            Rotation[4 * segment + 3] = turn.z;
            return this;
        }

        public Turn GetRotation(int segment)
        {
            return new Turn(Rotation[4 * segment + 1], Rotation[4 * segment + 2], Rotation[4 * segment + 3], Rotation[4 * segment]);
        }

        /// <summary>A turn in LPS, about where the joint is in the scan, as one in the joint's axes: A' q A.</summary>
        public Pose SetTurn(int segment, Turn turn)
        {
            var joint = _body.Segments[segment].Joint;
            return SetRotation(segment, new Turn(Dot(joint.AxisX, turn), Dot(joint.AxisY, turn), Dot(joint.AxisZ, turn), turn.w));
        }

        private static double Dot(Vector3 axis, Turn turn) => axis.X * turn.x + axis.Y * turn.y + axis.Z * turn.z;

        /// <summary>What a session shows.</summary>
        internal void Take(PoseState shown)
        {
            if (shown.Rotation.Count != Rotation.Length) return;
            shown.Rotation.Span.CopyTo(Rotation);
            Root = new Point3(shown.RootTranslation.X, shown.RootTranslation.Y, shown.RootTranslation.Z);
        }

        private static int Find(Joint joint, string angle)
        {
            for (int a = 0; a < joint.Sequence.Count && a < 3; ++a)
                if (joint.Sequence[a].Name == angle) return a;
            return -1;
        }

        private void Bend(int segment, Joint joint)
        {
            SetRotation(segment, JointAngles.Turn(joint, _angles[3 * segment], _angles[3 * segment + 1], _angles[3 * segment + 2]));
        }
    }
}
