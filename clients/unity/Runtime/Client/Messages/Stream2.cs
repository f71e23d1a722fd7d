// SPDX-License-Identifier: Apache-2.0
// Made by scripts/csharp_messages of proto/ecorche/v1/stream.proto, which says what these mean.
namespace Ecorche.Wire
{
    public sealed class PoseUpdate
    {
        public ulong Sequence;
        public ulong RigDigest;
        public bool HasRootTranslation; public readonly Vector3 RootTranslation = new Vector3();
        public readonly Repeated<double> Rotation = new Repeated<double>();
        public readonly Repeated<JointTranslation> Translation = new Repeated<JointTranslation>();
        public Skinning Skinning;

        public void Clear()
        {
            Sequence = default;
            RigDigest = default;
            HasRootTranslation = false;
            Rotation.Clear();
            Translation.Clear();
            Skinning = default;
        }

        internal void Write(WireWriter to)
        {
            if (Skinning != 0) to.UInt32(48, (uint)Skinning);
            for (int i = Translation.Count; --i >= 0;) { int end = to.Size; Translation[i].Write(to); to.Close(42, end); }
            if (Rotation.Count > 0) { int end = to.Size; for (int i = Rotation.Count; --i >= 0;) to.Double(Rotation[i]); to.Close(34, end); }
            if (HasRootTranslation) { int end = to.Size; RootTranslation.Write(to); to.Close(26, end); }
            if (RigDigest != 0) to.Fixed64(17, RigDigest);
            if (Sequence != 0) to.UInt64(8, Sequence);
        }
    }

    public sealed class PoseAck
    {
        public ulong Sequence;
        public bool HasStatus; public readonly Status Status = new Status();
        public readonly Repeated<ClampedJoint> Clamped = new Repeated<ClampedJoint>();
        public ulong Skipped;
        public readonly Repeated<ulong> SkippedSequences = new Repeated<ulong>();
        public bool HasTimings; public readonly ServerTimings Timings = new ServerTimings();

        public void Clear()
        {
            Sequence = default;
            HasStatus = false;
            Clamped.Clear();
            Skipped = default;
            SkippedSequences.Clear();
            HasTimings = false;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Sequence = from.UInt64(); break;
                    case 18: { var inner = from.Message(); Status.Read(ref inner); } HasStatus = true; break;
                    case 26: { var inner = from.Message(); Clamped.Add().Read(ref inner); } break;
                    case 32: Skipped = from.UInt64(); break;
                    case 40: SkippedSequences.Append(from.UInt64()); break;
                    case 42: { var inner = from.Message(); while (!inner.AtEnd) SkippedSequences.Append(inner.UInt64()); } break;
                    case 50: { var inner = from.Message(); Timings.Read(ref inner); } HasTimings = true; break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class ClampedJoint
    {
        public uint Joint;
        public string Name = "";
        public double Removed;

        public void Clear()
        {
            Joint = default;
            Name = "";
            Removed = default;
        }

        internal void Read(ref WireReader from)
        {
            var oldName = Name;
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Joint = from.UInt32(); break;
                    case 18: Name = from.String(oldName); break;
                    case 25: Removed = from.Double(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class ServerTimings
    {
        public ulong Waited;
        public ulong Posed;
        public ulong Encoded;
        public ulong Measured;

        public void Clear()
        {
            Waited = default;
            Posed = default;
            Encoded = default;
            Measured = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Waited = from.UInt64(); break;
                    case 16: Posed = from.UInt64(); break;
                    case 24: Encoded = from.UInt64(); break;
                    case 32: Measured = from.UInt64(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class MeshFrame
    {
        public uint Subscription;
        public ulong Frame;
        public ulong PoseSequence;
        public ulong TopologyDigest;
        public Encoding Encoding;
        public readonly Repeated<MeshArray> Arrays = new Repeated<MeshArray>();
        public bool HasTimings; public readonly ServerTimings Timings = new ServerTimings();
        public bool HasQuality; public readonly PoseQuality Quality = new PoseQuality();
        public uint Level;
        public ulong Keyframe;
        public bool HasBox; public readonly QuantiseBox Box = new QuantiseBox();
        public readonly Repeated<ClampedJoint> Clamped = new Repeated<ClampedJoint>();
        public bool HasPose; public readonly PoseState Pose = new PoseState();
        public Skinning Skinning;

        public void Clear()
        {
            Subscription = default;
            Frame = default;
            PoseSequence = default;
            TopologyDigest = default;
            Encoding = default;
            Arrays.Clear();
            HasTimings = false;
            HasQuality = false;
            Level = default;
            Keyframe = default;
            HasBox = false;
            Clamped.Clear();
            HasPose = false;
            Skinning = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Subscription = from.UInt32(); break;
                    case 16: Frame = from.UInt64(); break;
                    case 24: PoseSequence = from.UInt64(); break;
                    case 33: TopologyDigest = from.Fixed64(); break;
                    case 40: Encoding = (Encoding)from.UInt32(); break;
                    case 50: { var inner = from.Message(); Arrays.Add().Read(ref inner); } break;
                    case 58: { var inner = from.Message(); Timings.Read(ref inner); } HasTimings = true; break;
                    case 66: { var inner = from.Message(); Quality.Read(ref inner); } HasQuality = true; break;
                    case 72: Level = from.UInt32(); break;
                    case 80: Keyframe = from.UInt64(); break;
                    case 90: { var inner = from.Message(); Box.Read(ref inner); } HasBox = true; break;
                    case 98: { var inner = from.Message(); Clamped.Add().Read(ref inner); } break;
                    case 106: { var inner = from.Message(); Pose.Read(ref inner); } HasPose = true; break;
                    case 112: Skinning = (Skinning)from.UInt32(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class QuantiseBox
    {
        public float LowX;
        public float LowY;
        public float LowZ;
        public float Step;

        public void Clear()
        {
            LowX = default;
            LowY = default;
            LowZ = default;
            Step = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 13: LowX = from.Float(); break;
                    case 21: LowY = from.Float(); break;
                    case 29: LowZ = from.Float(); break;
                    case 37: Step = from.Float(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class MeshArray
    {
        public uint Tissue;
        public MeshArrayKind Kind;
        public bool HasArray; public readonly Array Array = new Array();

        public void Clear()
        {
            Tissue = default;
            Kind = default;
            HasArray = false;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Tissue = from.UInt32(); break;
                    case 16: Kind = (MeshArrayKind)from.UInt32(); break;
                    case 26: { var inner = from.Message(); Array.Read(ref inner); } HasArray = true; break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class VolumeFrame
    {
        public uint Subscription;
        public ulong Frame;
        public ulong PoseSequence;
        public uint Volume;
        public bool HasGrid; public readonly Grid Grid = new Grid();
        public bool HasVoxels; public readonly Array Voxels = new Array();
        public bool HasTimings; public readonly ServerTimings Timings = new ServerTimings();
        public bool HasStatus; public readonly Status Status = new Status();
        public ulong Keyframe;
        public bool HasBricks; public readonly Array Bricks = new Array();
        public bool HasContent; public readonly Array Content = new Array();

        public void Clear()
        {
            Subscription = default;
            Frame = default;
            PoseSequence = default;
            Volume = default;
            HasGrid = false;
            HasVoxels = false;
            HasTimings = false;
            HasStatus = false;
            Keyframe = default;
            HasBricks = false;
            HasContent = false;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Subscription = from.UInt32(); break;
                    case 16: Frame = from.UInt64(); break;
                    case 24: PoseSequence = from.UInt64(); break;
                    case 32: Volume = from.UInt32(); break;
                    case 42: { var inner = from.Message(); Grid.Read(ref inner); } HasGrid = true; break;
                    case 50: { var inner = from.Message(); Voxels.Read(ref inner); } HasVoxels = true; break;
                    case 58: { var inner = from.Message(); Timings.Read(ref inner); } HasTimings = true; break;
                    case 66: { var inner = from.Message(); Status.Read(ref inner); } HasStatus = true; break;
                    case 72: Keyframe = from.UInt64(); break;
                    case 82: { var inner = from.Message(); Bricks.Read(ref inner); } HasBricks = true; break;
                    case 90: { var inner = from.Message(); Content.Read(ref inner); } HasContent = true; break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class FrameAck
    {
        public uint Subscription;
        public ulong Frame;

        public void Clear()
        {
            Subscription = default;
            Frame = default;
        }

        internal void Write(WireWriter to)
        {
            if (Frame != 0) to.UInt64(16, Frame);
            if (Subscription != 0) to.UInt32(8, Subscription);
        }
    }
}
