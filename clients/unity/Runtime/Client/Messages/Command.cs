// SPDX-License-Identifier: Apache-2.0
// Made by scripts/csharp_messages of proto/ecorche/v1/command.proto, which says what these mean.
namespace Ecorche.Wire
{
    public enum ProbePointsDirection
    {
        Unspecified = 0,
        PosedToRest = 1,
        RestToPosed = 2,
    }

    public sealed class ClaimControl
    {
        public void Clear()
        {
        }

        internal void Write(WireWriter to)
        {
        }
    }

    public sealed class ControlGranted
    {
        public ulong LastSequence;
        public bool HasPose; public readonly PoseState Pose = new PoseState();

        public void Clear()
        {
            LastSequence = default;
            HasPose = false;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: LastSequence = from.UInt64(); break;
                    case 18: { var inner = from.Message(); Pose.Read(ref inner); } HasPose = true; break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class ReleaseControl
    {
        public void Clear()
        {
        }

        internal void Write(WireWriter to)
        {
        }
    }

    public sealed class ControlChanged
    {
        public Role Role;
        public bool Vacant;
        public double ReservedSeconds;

        public void Clear()
        {
            Role = default;
            Vacant = default;
            ReservedSeconds = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Role = (Role)from.UInt32(); break;
                    case 16: Vacant = from.Bool(); break;
                    case 25: ReservedSeconds = from.Double(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class ProbePoints
    {
        public ProbePointsDirection Direction;
        public bool HasPoints; public readonly Array Points = new Array();
        public readonly Repeated<string> Volumes = new Repeated<string>();
        public bool DeformationGradient;
        public bool Tissue;

        public void Clear()
        {
            Direction = default;
            HasPoints = false;
            Volumes.Clear();
            DeformationGradient = default;
            Tissue = default;
        }

        internal void Write(WireWriter to)
        {
            if (Tissue) to.Bool(40, Tissue);
            if (DeformationGradient) to.Bool(32, DeformationGradient);
            for (int i = Volumes.Count; --i >= 0;) to.String(26, Volumes[i]);
            if (HasPoints) { int end = to.Size; Points.Write(to); to.Close(18, end); }
            if (Direction != 0) to.UInt32(8, (uint)Direction);
        }
    }

    public sealed class Probed
    {
        public ulong PoseSequence;
        public bool HasPoints; public readonly Array Points = new Array();
        public bool HasTissue; public readonly Array Tissue = new Array();
        public bool HasValues; public readonly Array Values = new Array();
        public bool HasDeformationGradient; public readonly Array DeformationGradient = new Array();

        public void Clear()
        {
            PoseSequence = default;
            HasPoints = false;
            HasTissue = false;
            HasValues = false;
            HasDeformationGradient = false;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: PoseSequence = from.UInt64(); break;
                    case 18: { var inner = from.Message(); Points.Read(ref inner); } HasPoints = true; break;
                    case 26: { var inner = from.Message(); Tissue.Read(ref inner); } HasTissue = true; break;
                    case 34: { var inner = from.Message(); Values.Read(ref inner); } HasValues = true; break;
                    case 42: { var inner = from.Message(); DeformationGradient.Read(ref inner); } HasDeformationGradient = true; break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class ListClips
    {
        public void Clear()
        {
        }

        internal void Write(WireWriter to)
        {
        }
    }

    public sealed class ClipList
    {
        public readonly Repeated<ClipSummary> Clips = new Repeated<ClipSummary>();

        public void Clear()
        {
            Clips.Clear();
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 10: { var inner = from.Message(); Clips.Add().Read(ref inner); } break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class ClipSummary
    {
        public string Name = "";
        public double Seconds;
        public double FramesPerSecond;

        public void Clear()
        {
            Name = "";
            Seconds = default;
            FramesPerSecond = default;
        }

        internal void Read(ref WireReader from)
        {
            var oldName = Name;
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 10: Name = from.String(oldName); break;
                    case 17: Seconds = from.Double(); break;
                    case 25: FramesPerSecond = from.Double(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class PlayClip
    {
        public string Name = "";
        public double Speed;
        public bool Loop;
        public double Position;
        public bool Paused;

        public void Clear()
        {
            Name = "";
            Speed = default;
            Loop = default;
            Position = default;
            Paused = default;
        }

        internal void Write(WireWriter to)
        {
            if (Paused) to.Bool(40, Paused);
            if (Position != 0) to.Double(33, Position);
            if (Loop) to.Bool(24, Loop);
            if (Speed != 0) to.Double(17, Speed);
            if (Name.Length > 0) to.String(10, Name);
        }
    }

    public sealed class ModelChanged
    {
        public ulong Identity;

        public void Clear()
        {
            Identity = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 9: Identity = from.Fixed64(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }
}
