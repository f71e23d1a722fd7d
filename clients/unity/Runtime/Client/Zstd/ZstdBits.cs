// SPDX-License-Identifier: Apache-2.0
using System.Runtime.CompilerServices;

namespace Ecorche
{
    /// <summary>Bits that are read from their end; the last byte's highest one says where that is.</summary>
    internal unsafe struct ZstdBits
    {
        private readonly byte* _from;

        /// <summary>Bits that are left; below 0: more were read than there are.</summary>
        public int Left;

        /// <summary>There are 16 bytes before `from`, and eight behind its last one, that may be read.</summary>
        public ZstdBits(byte* from, int size)
        {
            if (size < 1 || from[size - 1] == 0) throw ZstdDecoder.Wrong();
            _from = from;
            Left = 8 * (size - 1) + ZstdDecoder.HighBit(from[size - 1]);
        }

        /// <summary>Of 32 bits at most. Who reads more than 128 bits looks at <see cref="Left"/> in between.</summary>
        [MethodImpl(MethodImplOptions.AggressiveInlining)]
        public uint Read(int count)
        {
            Left -= count;
            return (uint)((*(ulong*)(_from + (Left >> 3)) >> (Left & 7)) & ((1ul << count) - 1));
        }

        /// <summary>Bits that are not there are zeros.</summary>
        public uint ReadOrZeros(int count)
        {
            int lacks = count - Left;
            if (lacks <= 0) return Read(count);
            uint some = Left > 0 ? Read(Left) << lacks : 0;
            Left = -lacks;
            return some;
        }
    }
}
