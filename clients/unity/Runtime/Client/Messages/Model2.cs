// SPDX-License-Identifier: Apache-2.0
// Made by scripts/csharp_messages of proto/ecorche/v1/model.proto, which says what these mean.
namespace Ecorche.Wire
{
    public sealed class AngleAxis
    {
        public string Name = "";
        public uint Axis;
        public bool Negative;
        public double Rest;
        public double Min;
        public double Max;

        public void Clear()
        {
            Name = "";
            Axis = default;
            Negative = default;
            Rest = default;
            Min = default;
            Max = default;
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
                    case 16: Axis = from.UInt32(); break;
                    case 24: Negative = from.Bool(); break;
                    case 33: Rest = from.Double(); break;
                    case 41: Min = from.Double(); break;
                    case 49: Max = from.Double(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class Tissue
    {
        public string Name = "";
        public string Group = "";
        public int Segment;
        public ulong Vertices;
        public bool HasTriangles; public readonly Array Triangles = new Array();
        public bool HasPackedTriangles; public readonly Array PackedTriangles = new Array();
        public ulong TriangleCount;
        public byte[] CapVertices = System.Array.Empty<byte>();

        public void Clear()
        {
            Name = "";
            Group = "";
            Segment = default;
            Vertices = default;
            HasTriangles = false;
            HasPackedTriangles = false;
            TriangleCount = default;
            CapVertices = System.Array.Empty<byte>();
        }

        internal void Read(ref WireReader from)
        {
            var oldName = Name;
            var oldGroup = Group;
            var oldCapVertices = CapVertices;
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 10: Name = from.String(oldName); break;
                    case 18: Group = from.String(oldGroup); break;
                    case 24: Segment = from.SInt32(); break;
                    case 32: Vertices = from.UInt64(); break;
                    case 42: { var inner = from.Message(); Triangles.Read(ref inner); } HasTriangles = true; break;
                    case 50: { var inner = from.Message(); PackedTriangles.Read(ref inner); } HasPackedTriangles = true; break;
                    case 56: TriangleCount = from.UInt64(); break;
                    case 66: CapVertices = from.Bytes(oldCapVertices); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class Volume
    {
        public string Name = "";
        public bool HasGrid; public readonly Grid Grid = new Grid();
        public ScalarType Type;
        public uint Components;
        public double Background;
        public bool Labels;
        public readonly Repeated<VolumeTableEntry> Table = new Repeated<VolumeTableEntry>();

        public void Clear()
        {
            Name = "";
            HasGrid = false;
            Type = default;
            Components = default;
            Background = default;
            Labels = default;
            Table.Clear();
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
                    case 18: { var inner = from.Message(); Grid.Read(ref inner); } HasGrid = true; break;
                    case 24: Type = (ScalarType)from.UInt32(); break;
                    case 32: Components = from.UInt32(); break;
                    case 41: Background = from.Double(); break;
                    case 48: Labels = from.Bool(); break;
                    case 58: { var inner = from.Message(); Table.Add().Read(ref inner); } break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class VolumeTableEntry
    {
        public long Key;
        public string Value = "";

        public void Clear()
        {
            Key = default;
            Value = "";
        }

        internal void Read(ref WireReader from)
        {
            var oldValue = Value;
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Key = from.Int64(); break;
                    case 18: Value = from.String(oldValue); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class Grid
    {
        public uint SizeI;
        public uint SizeJ;
        public uint SizeK;
        public bool HasOrigin; public readonly Vector3 Origin = new Vector3();
        public bool HasSpacing; public readonly Vector3 Spacing = new Vector3();
        public readonly Repeated<double> Direction = new Repeated<double>();

        public void Clear()
        {
            SizeI = default;
            SizeJ = default;
            SizeK = default;
            HasOrigin = false;
            HasSpacing = false;
            Direction.Clear();
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: SizeI = from.UInt32(); break;
                    case 16: SizeJ = from.UInt32(); break;
                    case 24: SizeK = from.UInt32(); break;
                    case 34: { var inner = from.Message(); Origin.Read(ref inner); } HasOrigin = true; break;
                    case 42: { var inner = from.Message(); Spacing.Read(ref inner); } HasSpacing = true; break;
                    case 49: Direction.Append(from.Double()); break;
                    case 50: { var inner = from.Message(); while (!inner.AtEnd) Direction.Append(inner.Double()); } break;
                    default: from.Skip(key); break;
                }
            }
        }
    }
}
