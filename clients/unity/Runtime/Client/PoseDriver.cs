// SPDX-License-Identifier: Apache-2.0
using System;

namespace Ecorche
{
    /// <summary>How another skeleton stood when it was bound to the body.</summary>
    public enum Reference
    {
        /// <summary>As the patient was scanned.</summary>
        AsScanned,
        /// <summary>Upright, arms down, palms to the front: all anatomical angles 0.</summary>
        Anatomical,
        /// <summary>Likewise, with both arms out to the sides.</summary>
        TPose,
    }

    /// <summary>
    /// Poses a body as another skeleton moves: what each of its bones has turned since it stood as the reference, in one space for all, becomes the
    /// turn of the segment. Segments that it does not have stay in their joint as the reference has them.
    /// </summary>
    public sealed class PoseDriver
    {
        private const double Sideways = Math.PI / 2;
        private readonly Body _body;
        private readonly Turn[] _reference, _referenceGlobal, _turned, _global;
        private readonly bool[] _driven;
        private readonly double[] _angles = new double[3];  // of the joint that follows

        public PoseDriver(Body body, Reference reference)
        {
            _body = body;
            int count = body.Segments.Count;
            (_reference, _referenceGlobal, _turned, _global) = (new Turn[count], new Turn[count], new Turn[count], new Turn[count]);
            _driven = new bool[count];
            var pose = Of(body, reference);
            for (int s = 0; s < count; ++s)
            {
                _reference[s] = InBody(s, pose);
                _referenceGlobal[s] = Parent(_referenceGlobal, s) * _reference[s];
            }
        }

        /// <summary>The pose of a reference.</summary>
        public static Pose Of(Body body, Reference reference)
        {
            var pose = new Pose(body);
            for (int s = 0; s < body.Segments.Count && reference != Reference.AsScanned; ++s)
            {
                var joint = body.Segments[s].Joint;
                for (int a = 0; a < joint.Sequence.Count; ++a) pose.SetAngle(joint.Name, joint.Sequence[a].Name, 0);
                if (reference == Reference.TPose && joint.Name.StartsWith("shoulder", StringComparison.Ordinal)) pose.SetAngle(joint.Name, "abduction", Sideways);
            }
            return pose;
        }

        /// <summary>How far the segment's bone has turned, in LPS.</summary>
        public void Set(int segment, Turn turned)
        {
            _turned[segment] = turned;
            _driven[segment] = true;
        }

        /// <summary>Writes all turns into the pose.</summary>
        public void Apply(Pose pose)
        {
            for (int s = 0; s < _global.Length; ++s)
            {
                var parent = Parent(_global, s);
                if (!_driven[s] && Follow(s, pose))  // what hangs on it turns from where it will be
                {
                    _global[s] = parent * InBody(s, pose);
                    continue;
                }
                _global[s] = _driven[s] ? _turned[s] * _referenceGlobal[s] : parent * _reference[s];
                var local = parent.Inverse * _global[s];
                pose.SetTurn(s, local);
            }
        }

        /// <summary>Turns a joint that follows joints before it as the server will: each such angle by its ratio of theirs, counted from rest.</summary>
        private bool Follow(int segment, Pose pose)
        {
            var joint = _body.Segments[segment].Joint;
            for (int a = 0; a < 3; ++a) _angles[a] = a < joint.Sequence.Count ? joint.Sequence[a].Rest : 0;
            bool follows = false;
            for (int i = 0; i < joint.Coupled.Count; ++i)
            {
                var by = joint.Coupled[i];
                if (!by.HasDrivenAngle) continue;
                int lead = (int)by.Joint;
                if (lead >= segment) return false;
                var leader = _body.Segments[lead].Joint;
                _angles[by.DrivenAngle] += by.Ratio * (JointAngles.Of(leader, pose.GetRotation(lead), (int)by.Angle) - leader.Sequence[(int)by.Angle].Rest);
                follows = true;
            }
            if (follows) pose.SetRotation(segment, JointAngles.Turn(joint, _angles[0], _angles[1], _angles[2]));
            return follows;
        }

        private Turn Parent(Turn[] all, int segment)
        {
            int parent = _body.Segments[segment].Parent;
            return parent < 0 ? Turn.None : all[parent];
        }

        /// <summary>A q A': a joint's turn in LPS.</summary>
        private Turn InBody(int segment, Pose pose)
        {
            var q = pose.GetRotation(segment);
            var joint = _body.Segments[segment].Joint;
            return new Turn(joint.AxisX.X * q.x + joint.AxisY.X * q.y + joint.AxisZ.X * q.z, joint.AxisX.Y * q.x + joint.AxisY.Y * q.y + joint.AxisZ.Y * q.z,
                joint.AxisX.Z * q.x + joint.AxisY.Z * q.y + joint.AxisZ.Z * q.z, q.w);
        }
    }
}
