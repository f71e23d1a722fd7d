// SPDX-License-Identifier: Apache-2.0
// Made by scripts/csharp_messages of proto/ecorche/v1/model.proto, which says what these mean.
namespace Ecorche.Wire
{
    public enum Role
    {
        Unspecified = 0,
        Controller = 1,
        Observer = 2,
    }

    public enum JointKind
    {
        Unspecified = 0,
        Ball = 1,
        Hinge = 2,
        Universal = 3,
        Fixed = 4,
        Free = 5,
    }

    public sealed class ListModels
    {
        public void Clear()
        {
        }

        internal void Write(WireWriter to)
        {
        }
    }

    public sealed class ModelList
    {
        public readonly Repeated<ModelSummary> Models = new Repeated<ModelSummary>();

        public void Clear()
        {
            Models.Clear();
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 10: { var inner = from.Message(); Models.Add().Read(ref inner); } break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class ModelSummary
    {
        public string Name = "";
        public ulong Identity;
        public uint Segments;
        public uint Tissues;
        public ulong TissueVertices;
        public ulong Nodes;
        public ulong Tets;
        public readonly Repeated<string> Volumes = new Repeated<string>();

        public void Clear()
        {
            Name = "";
            Identity = default;
            Segments = default;
            Tissues = default;
            TissueVertices = default;
            Nodes = default;
            Tets = default;
            Volumes.Clear();
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
                    case 17: Identity = from.Fixed64(); break;
                    case 24: Segments = from.UInt32(); break;
                    case 32: Tissues = from.UInt32(); break;
                    case 40: TissueVertices = from.UInt64(); break;
                    case 48: Nodes = from.UInt64(); break;
                    case 56: Tets = from.UInt64(); break;
                    case 66: Volumes.Append(from.String(Volumes.Spare)); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class OpenModel
    {
        public string Model = "";
        public string Session = "";
        public bool WithoutTriangles;
        public bool PackedTriangles;
        public bool Watch;

        public void Clear()
        {
            Model = "";
            Session = "";
            WithoutTriangles = default;
            PackedTriangles = default;
            Watch = default;
        }

        internal void Write(WireWriter to)
        {
            if (Watch) to.Bool(40, Watch);
            if (PackedTriangles) to.Bool(32, PackedTriangles);
            if (WithoutTriangles) to.Bool(24, WithoutTriangles);
            if (Session.Length > 0) to.String(18, Session);
            if (Model.Length > 0) to.String(10, Model);
        }
    }

    public sealed class ModelOpened
    {
        public string Model = "";
        public ulong Identity;
        public ulong RigDigest;
        public ulong TopologyDigest;
        public string Session = "";
        public Role Role;
        public bool HasSkeleton; public readonly Skeleton Skeleton = new Skeleton();
        public readonly Repeated<Tissue> Tissues = new Repeated<Tissue>();
        public readonly Repeated<Volume> Volumes = new Repeated<Volume>();
        public bool HasPose; public readonly PoseState Pose = new PoseState();
        public ulong LastSequence;
        public bool Corrected;
        public readonly Repeated<SafeRange> SafeRanges = new Repeated<SafeRange>();

        public void Clear()
        {
            Model = "";
            Identity = default;
            RigDigest = default;
            TopologyDigest = default;
            Session = "";
            Role = default;
            HasSkeleton = false;
            Tissues.Clear();
            Volumes.Clear();
            HasPose = false;
            LastSequence = default;
            Corrected = default;
            SafeRanges.Clear();
        }

        internal void Read(ref WireReader from)
        {
            var oldModel = Model;
            var oldSession = Session;
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 10: Model = from.String(oldModel); break;
                    case 17: Identity = from.Fixed64(); break;
                    case 25: RigDigest = from.Fixed64(); break;
                    case 33: TopologyDigest = from.Fixed64(); break;
                    case 42: Session = from.String(oldSession); break;
                    case 48: Role = (Role)from.UInt32(); break;
                    case 58: { var inner = from.Message(); Skeleton.Read(ref inner); } HasSkeleton = true; break;
                    case 66: { var inner = from.Message(); Tissues.Add().Read(ref inner); } break;
                    case 74: { var inner = from.Message(); Volumes.Add().Read(ref inner); } break;
                    case 82: { var inner = from.Message(); Pose.Read(ref inner); } HasPose = true; break;
                    case 88: LastSequence = from.UInt64(); break;
                    case 96: Corrected = from.Bool(); break;
                    case 106: { var inner = from.Message(); SafeRanges.Add().Read(ref inner); } break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class SafeRange
    {
        public uint Joint;
        public uint Angle;
        public bool Negative;
        public double Looked;
        public double SkinnedInverted;
        public double CorrectedInverted;
        public double SkinnedVolume;
        public double CorrectedVolume;
        public double Bones;
        public bool HasSkinnedContact; public double SkinnedContact;
        public bool HasCorrectedContact; public double CorrectedContact;

        public void Clear()
        {
            Joint = default;
            Angle = default;
            Negative = default;
            Looked = default;
            SkinnedInverted = default;
            CorrectedInverted = default;
            SkinnedVolume = default;
            CorrectedVolume = default;
            Bones = default;
            HasSkinnedContact = false; SkinnedContact = default;
            HasCorrectedContact = false; CorrectedContact = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Joint = from.UInt32(); break;
                    case 16: Angle = from.UInt32(); break;
                    case 24: Negative = from.Bool(); break;
                    case 33: Looked = from.Double(); break;
                    case 41: SkinnedInverted = from.Double(); break;
                    case 49: CorrectedInverted = from.Double(); break;
                    case 57: SkinnedVolume = from.Double(); break;
                    case 65: CorrectedVolume = from.Double(); break;
                    case 73: Bones = from.Double(); break;
                    case 81: SkinnedContact = from.Double(); HasSkinnedContact = true; break;
                    case 89: CorrectedContact = from.Double(); HasCorrectedContact = true; break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class Skeleton
    {
        public string Name = "";
        public readonly Repeated<Segment> Segments = new Repeated<Segment>();

        public void Clear()
        {
            Name = "";
            Segments.Clear();
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
                    case 18: { var inner = from.Message(); Segments.Add().Read(ref inner); } break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class Segment
    {
        public string Name = "";
        public int Parent;
        public bool HasJoint; public readonly Joint Joint = new Joint();
        public readonly Repeated<string> Aliases = new Repeated<string>();

        public void Clear()
        {
            Name = "";
            Parent = default;
            HasJoint = false;
            Aliases.Clear();
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
                    case 16: Parent = from.SInt32(); break;
                    case 26: { var inner = from.Message(); Joint.Read(ref inner); } HasJoint = true; break;
                    case 34: Aliases.Append(from.String(Aliases.Spare)); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class Joint
    {
        public string Name = "";
        public JointKind Kind;
        public bool HasCenter; public readonly Vector3 Center = new Vector3();
        public bool HasAxisX; public readonly Vector3 AxisX = new Vector3();
        public bool HasAxisY; public readonly Vector3 AxisY = new Vector3();
        public bool HasAxisZ; public readonly Vector3 AxisZ = new Vector3();
        public readonly Repeated<AngleAxis> Sequence = new Repeated<AngleAxis>();
        public readonly Repeated<JointCoupling> Coupled = new Repeated<JointCoupling>();

        public void Clear()
        {
            Name = "";
            Kind = default;
            HasCenter = false;
            HasAxisX = false;
            HasAxisY = false;
            HasAxisZ = false;
            Sequence.Clear();
            Coupled.Clear();
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
                    case 16: Kind = (JointKind)from.UInt32(); break;
                    case 26: { var inner = from.Message(); Center.Read(ref inner); } HasCenter = true; break;
                    case 34: { var inner = from.Message(); AxisX.Read(ref inner); } HasAxisX = true; break;
                    case 42: { var inner = from.Message(); AxisY.Read(ref inner); } HasAxisY = true; break;
                    case 50: { var inner = from.Message(); AxisZ.Read(ref inner); } HasAxisZ = true; break;
                    case 58: { var inner = from.Message(); Sequence.Add().Read(ref inner); } break;
                    case 66: { var inner = from.Message(); Coupled.Add().Read(ref inner); } break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class JointCoupling
    {
        public uint Joint;
        public uint Angle;
        public bool HasDrivenAngle; public uint DrivenAngle;
        public bool HasSlideAxis; public uint SlideAxis;
        public double Ratio;

        public void Clear()
        {
            Joint = default;
            Angle = default;
            HasDrivenAngle = false; DrivenAngle = default;
            HasSlideAxis = false; SlideAxis = default;
            Ratio = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Joint = from.UInt32(); break;
                    case 16: Angle = from.UInt32(); break;
                    case 24: DrivenAngle = from.UInt32(); HasDrivenAngle = true; break;
                    case 32: SlideAxis = from.UInt32(); HasSlideAxis = true; break;
                    case 41: Ratio = from.Double(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }
}
