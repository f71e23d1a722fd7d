// SPDX-License-Identifier: Apache-2.0
// Made by scripts/csharp_messages of proto/ecorche/v1/common.proto, which says what these mean.
namespace Ecorche.Wire
{
    public enum ScalarType
    {
        Unspecified = 0,
        U8 = 1,
        I8 = 2,
        U16 = 3,
        I16 = 4,
        U32 = 5,
        I32 = 6,
        F32 = 7,
        F64 = 8,
    }

    public enum Encoding
    {
        Unspecified = 0,
        F32 = 1,
        U16 = 2,
        U16Delta = 3,
    }

    public enum Skinning
    {
        Unspecified = 0,
        Cor = 1,
        Dqs = 2,
        Lbs = 3,
    }

    public sealed class Status
    {
        public uint Code;
        public string Message = "";

        public void Clear()
        {
            Code = default;
            Message = "";
        }

        internal void Read(ref WireReader from)
        {
            var oldMessage = Message;
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Code = from.UInt32(); break;
                    case 18: Message = from.String(oldMessage); break;
                    default: from.Skip(key); break;
                }
            }
        }

        internal void Write(WireWriter to)
        {
            if (Message.Length > 0) to.String(18, Message);
            if (Code != 0) to.UInt32(8, Code);
        }
    }

    public sealed class Vector3
    {
        public double X;
        public double Y;
        public double Z;

        public void Clear()
        {
            X = default;
            Y = default;
            Z = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 9: X = from.Double(); break;
                    case 17: Y = from.Double(); break;
                    case 25: Z = from.Double(); break;
                    default: from.Skip(key); break;
                }
            }
        }

        internal void Write(WireWriter to)
        {
            if (Z != 0) to.Double(25, Z);
            if (Y != 0) to.Double(17, Y);
            if (X != 0) to.Double(9, X);
        }
    }

    public sealed class Array
    {
        public ScalarType Type;
        public uint Components;
        public ulong Count;
        public ulong Offset;

        public void Clear()
        {
            Type = default;
            Components = default;
            Count = default;
            Offset = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Type = (ScalarType)from.UInt32(); break;
                    case 16: Components = from.UInt32(); break;
                    case 24: Count = from.UInt64(); break;
                    case 32: Offset = from.UInt64(); break;
                    default: from.Skip(key); break;
                }
            }
        }

        internal void Write(WireWriter to)
        {
            if (Offset != 0) to.UInt64(32, Offset);
            if (Count != 0) to.UInt64(24, Count);
            if (Components != 0) to.UInt32(16, Components);
            if (Type != 0) to.UInt32(8, (uint)Type);
        }
    }

    public sealed class JointTranslation
    {
        public uint Joint;
        public bool HasOffset; public readonly Vector3 Offset = new Vector3();

        public void Clear()
        {
            Joint = default;
            HasOffset = false;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Joint = from.UInt32(); break;
                    case 18: { var inner = from.Message(); Offset.Read(ref inner); } HasOffset = true; break;
                    default: from.Skip(key); break;
                }
            }
        }

        internal void Write(WireWriter to)
        {
            if (HasOffset) { int end = to.Size; Offset.Write(to); to.Close(18, end); }
            if (Joint != 0) to.UInt32(8, Joint);
        }
    }

    public sealed class PoseState
    {
        public ulong Sequence;
        public bool HasRootTranslation; public readonly Vector3 RootTranslation = new Vector3();
        public readonly Repeated<double> Rotation = new Repeated<double>();
        public readonly Repeated<JointTranslation> Translation = new Repeated<JointTranslation>();
        public Skinning Skinning;

        public void Clear()
        {
            Sequence = default;
            HasRootTranslation = false;
            Rotation.Clear();
            Translation.Clear();
            Skinning = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Sequence = from.UInt64(); break;
                    case 18: { var inner = from.Message(); RootTranslation.Read(ref inner); } HasRootTranslation = true; break;
                    case 25: Rotation.Append(from.Double()); break;
                    case 26: { var inner = from.Message(); while (!inner.AtEnd) Rotation.Append(inner.Double()); } break;
                    case 34: { var inner = from.Message(); Translation.Add().Read(ref inner); } break;
                    case 40: Skinning = (Skinning)from.UInt32(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }
}
