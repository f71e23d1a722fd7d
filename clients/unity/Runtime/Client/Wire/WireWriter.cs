// SPDX-License-Identifier: Apache-2.0
using System;
using System.Buffers.Binary;

namespace Ecorche.Wire
{
    /// <summary>Writes Protobuf's bytes from the end to the beginning: so the size of what lies within is known when it is told.</summary>
    internal sealed class WireWriter
    {
        private byte[] _bytes = new byte[1024];

        /// <summary>Bytes written so far.</summary>
        public int Size { get; private set; }

        public ReadOnlySpan<byte> Written => _bytes.AsSpan(_bytes.Length - Size);

        public void Begin() => Size = 0;

        /// <summary>Tells key and size of what was written since Size was `before`.</summary>
        public void Close(uint key, int before)
        {
            Varint((ulong)(Size - before));
            Varint(key);
        }

        /// <summary>Of packed numbers, without a key.</summary>
        public void Double(double value) => BinaryPrimitives.WriteInt64LittleEndian(Room(8), BitConverter.DoubleToInt64Bits(value));

        public void UInt32(uint value) => Varint(value);

        public void UInt32(uint key, uint value) => UInt64(key, value);

        public void UInt64(uint key, ulong value)
        {
            Varint(value);
            Varint(key);
        }

        public void Bool(uint key, bool value) => UInt64(key, value ? 1u : 0u);

        public void SInt32(uint key, int value) => UInt64(key, (uint)((value << 1) ^ (value >> 31)));

        public void Fixed64(uint key, ulong value)
        {
            BinaryPrimitives.WriteUInt64LittleEndian(Room(8), value);
            Varint(key);
        }

        public void Double(uint key, double value)
        {
            Double(value);
            Varint(key);
        }

        public void String(uint key, string value)
        {
            int before = Size, size = System.Text.Encoding.UTF8.GetByteCount(value);
            System.Text.Encoding.UTF8.GetBytes(value, Room(size));
            Close(key, before);
        }

        public void Bytes(uint key, byte[] value)
        {
            int before = Size;
            value.AsSpan().CopyTo(Room(value.Length));
            Close(key, before);
        }

        private void Varint(ulong value)
        {
            int size = 1;
            for (ulong rest = value >> 7; rest != 0; rest >>= 7) ++size;
            var to = Room(size);
            for (int i = 0; i < size; ++i, value >>= 7) to[i] = (byte)((value & 127) | (i + 1 < size ? 128u : 0u));
        }

        /// <summary>The next `size` bytes in front of what was written.</summary>
        private Span<byte> Room(int size)
        {
            if (size > _bytes.Length - Size)
            {
                var grown = new byte[Math.Max(2 * _bytes.Length, Size + size)];
                Written.CopyTo(grown.AsSpan(grown.Length - Size));
                _bytes = grown;
            }
            Size += size;
            return _bytes.AsSpan(_bytes.Length - Size, size);
        }
    }
}
