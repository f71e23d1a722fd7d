// SPDX-License-Identifier: Apache-2.0
using System;
using System.Buffers.Binary;

namespace Ecorche.Wire
{
    /// <summary>Reads Protobuf's bytes. Throws <see cref="EcorcheException"/> (DataLoss) for what is none.</summary>
    internal ref struct WireReader
    {
        private readonly ReadOnlySpan<byte> _bytes;
        private readonly int _depth;
        private int _at;

        /// <summary>As Protobuf's own: deeper messages are refused.</summary>
        private const int MostDepth = 100;

        public WireReader(ReadOnlySpan<byte> bytes, int depth = 0)
        {
            _bytes = bytes;
            _depth = depth;
            _at = 0;
        }

        public bool AtEnd => _at == _bytes.Length;

        /// <summary>Field number * 8 + wire type; 0 at the end.</summary>
        public uint Key()
        {
            if (AtEnd) return 0;
            ulong key = UInt64();
            if (key < 8 || key > uint.MaxValue) throw Bad();
            return (uint)key;
        }

        public ulong UInt64()
        {
            ulong value = 0;
            for (int shift = 0; shift < 64; shift += 7)
            {
                if (_at >= _bytes.Length) throw Bad();
                byte next = _bytes[_at++];
                value |= (ulong)(next & 127) << shift;
                if (next < 128) return value;
            }
            throw Bad();
        }

        public uint UInt32() => (uint)UInt64();
        public int Int32() => (int)UInt64();
        public long Int64() => (long)UInt64();
        public bool Bool() => UInt64() != 0;

        public int SInt32()
        {
            uint value = UInt32();
            return (int)(value >> 1) ^ -(int)(value & 1);
        }

        public ulong Fixed64() => BinaryPrimitives.ReadUInt64LittleEndian(Take(8));
        public double Double() => BitConverter.Int64BitsToDouble(BinaryPrimitives.ReadInt64LittleEndian(Take(8)));
        public float Float() => BitConverter.Int32BitsToSingle(BinaryPrimitives.ReadInt32LittleEndian(Take(4)));

        public WireReader Message()
        {
            if (_depth >= MostDepth) throw Bad();
            return new WireReader(Counted(), _depth + 1);
        }

        /// <summary>Of names that come again and again nothing is allocated: `old` is returned where it is the same.</summary>
        public string String(string old)
        {
            var bytes = Counted();
            if (bytes.Length == 0) return "";
            bool same = old != null && old.Length == bytes.Length;
            for (int i = 0; same && i < bytes.Length; ++i) same = bytes[i] < 128 && bytes[i] == old[i];
            return same ? old : System.Text.Encoding.UTF8.GetString(bytes);
        }

        public byte[] Bytes(byte[] old)
        {
            var bytes = Counted();
            return old != null && bytes.SequenceEqual(old) ? old : bytes.ToArray();
        }

        public void Skip(uint key)
        {
            switch (key & 7)
            {
                case 0: UInt64(); break;
                case 1: Take(8); break;
                case 2: Counted(); break;
                case 5: Take(4); break;
                default: throw Bad();
            }
        }

        private ReadOnlySpan<byte> Counted()
        {
            ulong size = UInt64();
            if (size > int.MaxValue) throw Bad();
            return Take((int)size);
        }

        private ReadOnlySpan<byte> Take(int size)
        {
            if (size > _bytes.Length - _at) throw Bad();
            var taken = _bytes.Slice(_at, size);
            _at += size;
            return taken;
        }

        private static EcorcheException Bad() => EcorcheException.Damaged("it is no envelope");
    }
}
