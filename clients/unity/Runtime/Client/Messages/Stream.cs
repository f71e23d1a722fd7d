// SPDX-License-Identifier: Apache-2.0
// Made by scripts/csharp_messages of proto/ecorche/v1/stream.proto, which says what these mean.
namespace Ecorche.Wire
{
    public enum Deformer
    {
        Unspecified = 0,
        Tets = 1,
        Spheres = 2,
    }

    public enum MeshArrayKind
    {
        Unspecified = 0,
        Positions = 1,
        Normals = 2,
        Nodes = 3,
        Segments = 4,
        Motions = 5,
    }

    public enum PoseQualityVerdict
    {
        Unspecified = 0,
        Pass = 1,
        Warn = 2,
    }

    public sealed class Subscribe
    {
        public bool HasMesh; public readonly MeshSelection Mesh = new MeshSelection();
        public bool HasVolume; public readonly VolumeSelection Volume = new VolumeSelection();
        public double MaxRate;

        public void Clear()
        {
            HasMesh = false;
            HasVolume = false;
            MaxRate = default;
        }

        internal void Write(WireWriter to)
        {
            if (MaxRate != 0) to.Double(25, MaxRate);
            if (HasVolume) { int end = to.Size; Volume.Write(to); to.Close(18, end); }
            if (HasMesh) { int end = to.Size; Mesh.Write(to); to.Close(10, end); }
        }
    }

    public sealed class MeshSelection
    {
        public readonly Repeated<string> Tissues = new Repeated<string>();
        public Encoding Encoding;
        public bool Normals;
        public bool Quality;
        public bool HasRegion; public readonly Box Region = new Box();
        public uint Level;
        public bool Adaptive;
        public bool ControlNodes;
        public bool Pose;
        public bool Motions;

        public void Clear()
        {
            Tissues.Clear();
            Encoding = default;
            Normals = default;
            Quality = default;
            HasRegion = false;
            Level = default;
            Adaptive = default;
            ControlNodes = default;
            Pose = default;
            Motions = default;
        }

        internal void Write(WireWriter to)
        {
            if (Motions) to.Bool(80, Motions);
            if (Pose) to.Bool(72, Pose);
            if (ControlNodes) to.Bool(64, ControlNodes);
            if (Adaptive) to.Bool(56, Adaptive);
            if (Level != 0) to.UInt32(48, Level);
            if (HasRegion) { int end = to.Size; Region.Write(to); to.Close(42, end); }
            if (Quality) to.Bool(32, Quality);
            if (Normals) to.Bool(24, Normals);
            if (Encoding != 0) to.UInt32(16, (uint)Encoding);
            for (int i = Tissues.Count; --i >= 0;) to.String(10, Tissues[i]);
        }
    }

    public sealed class VolumeSelection
    {
        public string Volume = "";
        public bool Nearest;
        public bool HasRegion; public readonly Box Region = new Box();
        public readonly Repeated<Slice> Slices = new Repeated<Slice>();
        public bool Compressed;
        public Deformer Deformer;
        public bool ChangedBricks;

        public void Clear()
        {
            Volume = "";
            Nearest = default;
            HasRegion = false;
            Slices.Clear();
            Compressed = default;
            Deformer = default;
            ChangedBricks = default;
        }

        internal void Write(WireWriter to)
        {
            if (ChangedBricks) to.Bool(56, ChangedBricks);
            if (Deformer != 0) to.UInt32(48, (uint)Deformer);
            if (Compressed) to.Bool(40, Compressed);
            for (int i = Slices.Count; --i >= 0;) { int end = to.Size; Slices[i].Write(to); to.Close(34, end); }
            if (HasRegion) { int end = to.Size; Region.Write(to); to.Close(26, end); }
            if (Nearest) to.Bool(16, Nearest);
            if (Volume.Length > 0) to.String(10, Volume);
        }
    }

    public sealed class Box
    {
        public bool HasMin; public readonly Vector3 Min = new Vector3();
        public bool HasMax; public readonly Vector3 Max = new Vector3();

        public void Clear()
        {
            HasMin = false;
            HasMax = false;
        }

        internal void Write(WireWriter to)
        {
            if (HasMax) { int end = to.Size; Max.Write(to); to.Close(18, end); }
            if (HasMin) { int end = to.Size; Min.Write(to); to.Close(10, end); }
        }
    }

    public sealed class Slice
    {
        public bool HasOrigin; public readonly Vector3 Origin = new Vector3();
        public bool HasU; public readonly Vector3 U = new Vector3();
        public bool HasV; public readonly Vector3 V = new Vector3();
        public uint SizeU;
        public uint SizeV;

        public void Clear()
        {
            HasOrigin = false;
            HasU = false;
            HasV = false;
            SizeU = default;
            SizeV = default;
        }

        internal void Write(WireWriter to)
        {
            if (SizeV != 0) to.UInt32(40, SizeV);
            if (SizeU != 0) to.UInt32(32, SizeU);
            if (HasV) { int end = to.Size; V.Write(to); to.Close(26, end); }
            if (HasU) { int end = to.Size; U.Write(to); to.Close(18, end); }
            if (HasOrigin) { int end = to.Size; Origin.Write(to); to.Close(10, end); }
        }
    }

    public sealed class Subscribed
    {
        public uint Subscription;
        public readonly Repeated<MeshLevel> Levels = new Repeated<MeshLevel>();
        public readonly Repeated<TissueBinding> Bindings = new Repeated<TissueBinding>();
        public double Step;
        public bool HasSkinning; public readonly SkinningData Skinning = new SkinningData();

        public void Clear()
        {
            Subscription = default;
            Levels.Clear();
            Bindings.Clear();
            Step = default;
            HasSkinning = false;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Subscription = from.UInt32(); break;
                    case 18: { var inner = from.Message(); Levels.Add().Read(ref inner); } break;
                    case 26: { var inner = from.Message(); Bindings.Add().Read(ref inner); } break;
                    case 33: Step = from.Double(); break;
                    case 42: { var inner = from.Message(); Skinning.Read(ref inner); } HasSkinning = true; break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class MeshLevel
    {
        public uint Level;
        public readonly Repeated<MeshPart> Parts = new Repeated<MeshPart>();

        public void Clear()
        {
            Level = default;
            Parts.Clear();
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Level = from.UInt32(); break;
                    case 18: { var inner = from.Message(); Parts.Add().Read(ref inner); } break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class MeshPart
    {
        public uint Tissue;
        public bool HasVertices; public readonly Array Vertices = new Array();
        public bool HasTriangles; public readonly Array Triangles = new Array();

        public void Clear()
        {
            Tissue = default;
            HasVertices = false;
            HasTriangles = false;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Tissue = from.UInt32(); break;
                    case 18: { var inner = from.Message(); Vertices.Read(ref inner); } HasVertices = true; break;
                    case 26: { var inner = from.Message(); Triangles.Read(ref inner); } HasTriangles = true; break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class TissueBinding
    {
        public uint Tissue;
        public int Segment;
        public bool HasRest; public readonly Array Rest = new Array();
        public bool HasCorners; public readonly Array Corners = new Array();
        public bool HasBarycentric; public readonly Array Barycentric = new Array();

        public void Clear()
        {
            Tissue = default;
            Segment = default;
            HasRest = false;
            HasCorners = false;
            HasBarycentric = false;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Tissue = from.UInt32(); break;
                    case 16: Segment = from.SInt32(); break;
                    case 26: { var inner = from.Message(); Rest.Read(ref inner); } HasRest = true; break;
                    case 34: { var inner = from.Message(); Corners.Read(ref inner); } HasCorners = true; break;
                    case 42: { var inner = from.Message(); Barycentric.Read(ref inner); } HasBarycentric = true; break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class SkinningData
    {
        public bool HasBox; public readonly QuantiseBox Box = new QuantiseBox();
        public readonly Repeated<TissueSkinning> Tissues = new Repeated<TissueSkinning>();
        public double LargestError;
        public double LargestNormalError;
        public double UsualNormalError;
        public readonly Repeated<string> Measured = new Repeated<string>();
        public bool WithoutCorrection;

        public void Clear()
        {
            HasBox = false;
            Tissues.Clear();
            LargestError = default;
            LargestNormalError = default;
            UsualNormalError = default;
            Measured.Clear();
            WithoutCorrection = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 10: { var inner = from.Message(); Box.Read(ref inner); } HasBox = true; break;
                    case 18: { var inner = from.Message(); Tissues.Add().Read(ref inner); } break;
                    case 25: LargestError = from.Double(); break;
                    case 33: LargestNormalError = from.Double(); break;
                    case 41: UsualNormalError = from.Double(); break;
                    case 50: Measured.Append(from.String(Measured.Spare)); break;
                    case 56: WithoutCorrection = from.Bool(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class TissueSkinning
    {
        public uint Tissue;
        public uint Vertices;
        public uint Influences;
        public bool HasPoints; public readonly Array Points = new Array();
        public uint PointCount;
        public bool HasHung; public readonly Array Hung = new Array();
        public uint HungCount;

        public void Clear()
        {
            Tissue = default;
            Vertices = default;
            Influences = default;
            HasPoints = false;
            PointCount = default;
            HasHung = false;
            HungCount = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Tissue = from.UInt32(); break;
                    case 16: Vertices = from.UInt32(); break;
                    case 24: Influences = from.UInt32(); break;
                    case 34: { var inner = from.Message(); Points.Read(ref inner); } HasPoints = true; break;
                    case 40: PointCount = from.UInt32(); break;
                    case 50: { var inner = from.Message(); Hung.Read(ref inner); } HasHung = true; break;
                    case 56: HungCount = from.UInt32(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class Unsubscribe
    {
        public uint Subscription;

        public void Clear()
        {
            Subscription = default;
        }

        internal void Write(WireWriter to)
        {
            if (Subscription != 0) to.UInt32(8, Subscription);
        }
    }
}
