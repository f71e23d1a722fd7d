// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using UnityEngine;

namespace Ecorche.Components
{
    /// <summary>
    /// Poses a server's body as a tree of Transforms moves: a Humanoid Avatar's (by its muscles, clips, IK), or any whose names are the skeleton's or
    /// what motion files call them.
    /// </summary>
    [AddComponentMenu("Ecorche/Pose")]
    public sealed class EcorchePose : MonoBehaviour
    {
        /// <summary>Bones of a Humanoid, and what the skeletons of ecorche call such a segment; first those that lead a spine by vertebra.</summary>
        private static readonly (HumanBodyBones bone, string segment)[] Humanoid =
        {
            (HumanBodyBones.Spine, "lumbar_spine"), (HumanBodyBones.Chest, "thoracic_spine"), (HumanBodyBones.Neck, "cervical_spine"),
            (HumanBodyBones.Head, "upper_cervical_spine"), (HumanBodyBones.Hips, "pelvis"), (HumanBodyBones.Spine, "lumbar"), (HumanBodyBones.Chest, "thorax"), (HumanBodyBones.Neck, "neck"),
            (HumanBodyBones.Head, "head"), (HumanBodyBones.LeftShoulder, "girdle_left"), (HumanBodyBones.RightShoulder, "girdle_right"),
            (HumanBodyBones.LeftUpperArm, "upper_arm_left"), (HumanBodyBones.RightUpperArm, "upper_arm_right"),
            (HumanBodyBones.LeftLowerArm, "forearm_left"), (HumanBodyBones.RightLowerArm, "forearm_right"), (HumanBodyBones.LeftHand, "hand_left"),
            (HumanBodyBones.RightHand, "hand_right"), (HumanBodyBones.LeftUpperLeg, "thigh_left"), (HumanBodyBones.RightUpperLeg, "thigh_right"),
            (HumanBodyBones.LeftLowerLeg, "shank_left"), (HumanBodyBones.RightLowerLeg, "shank_right"), (HumanBodyBones.LeftFoot, "foot_left"),
            (HumanBodyBones.RightFoot, "foot_right"), (HumanBodyBones.LeftToes, "toes_left"), (HumanBodyBones.RightToes, "toes_right"),
        };

        public EcorcheServer server;
        [Tooltip("A Humanoid: its bones drive the body")]
        public Animator humanoid;
        [Tooltip("Else a tree of Transforms, matched by name")]
        public Transform root;
        [Tooltip("How the bones stand when this component is enabled")]
        public Reference reference = Reference.TPose;
        [Tooltip("The body goes where the hips go")]
        public bool moves = true;

        private readonly List<Bound> _bound = new List<Bound>();
        private HumanPoseHandler _muscles;
        private HumanPose _humanPose;
        private PoseDriver _driver;
        private Pose _pose;
        private int _generation;

        private struct Bound
        {
            public int Segment;
            public Transform Bone;
            public Quaternion Rest;
            public Vector3 Place;
        }

        /// <summary>How many segments a bone was found for.</summary>
        public int BoundCount => _bound.Count;

        /// <summary>Moves the Humanoid by Unity's muscles (HumanTrait.MuscleName, -1 to 1 each), and the body with it.</summary>
        public void SetMuscles(float[] muscles)
        {
            if (humanoid == null || muscles.Length != HumanTrait.MuscleCount) throw new ArgumentException("needs a Humanoid, and a number for each of its muscles");
            if (_muscles == null) _muscles = new HumanPoseHandler(humanoid.avatar, humanoid.transform);
            _muscles.GetHumanPose(ref _humanPose);
            Array.Copy(muscles, _humanPose.muscles, muscles.Length);
            _muscles.SetHumanPose(ref _humanPose);
        }

        private void OnDisable()
        {
            _muscles?.Dispose();
            _muscles = null;
            _bound.Clear();
            _driver = null;
        }

        private void LateUpdate()
        {
            if (server == null || server.State != LinkState.Open || server.Body == null) return;
            if (_driver == null || _generation != server.Generation) Bind();
            var frame = Frame();
            var axes = Axes.Of(Space.Unity);
            foreach (var one in _bound)
            {
                var turned = Quaternion.Inverse(frame.rotation) * one.Bone.rotation * Quaternion.Inverse(one.Rest);
                _driver.Set(one.Segment, axes.RotationBack(new Turn(turned.x, turned.y, turned.z, turned.w)));
                if (one.Segment == 0 && moves) _pose.Root = Gone(frame.InverseTransformPoint(one.Bone.position) - one.Place, axes);
            }
            _driver.Apply(_pose);
            server.SetPose(_pose);
        }

        private static Point3 Gone(Vector3 by, Axes axes) => axes.PointBack(by.x, by.y, by.z);

        private Transform Frame() => humanoid != null ? humanoid.transform : root != null ? root : transform;

        private void Bind()
        {
            _generation = server.Generation;
            _driver = new PoseDriver(server.Body, reference);
            _pose = new Pose(server.Body);
            _bound.Clear();
            if (humanoid != null && humanoid.isHuman)
                foreach (var one in Humanoid) Bind(humanoid.GetBoneTransform(one.bone), server.Body.FindSegment(one.segment));
            else
                foreach (var bone in Frame().GetComponentsInChildren<Transform>()) Bind(bone, server.Body.FindSegment(bone.name));
            if (_bound.Count == 0) Debug.LogWarning("Ecorche: no bone of " + Frame().name + " has a segment's name", this);
        }

        private void Bind(Transform bone, int segment)
        {
            if (bone == null || segment < 0 || _bound.Exists(one => one.Segment == segment || one.Bone == bone)) return;
            var frame = Frame();
            _bound.Add(new Bound
            {
                Segment = segment, Bone = bone, Rest = Quaternion.Inverse(frame.rotation) * bone.rotation, Place = frame.InverseTransformPoint(bone.position),
            });
        }
    }
}
