// SPDX-License-Identifier: Apache-2.0
using System;

namespace Ecorche
{
    /// <summary>Reads meshoptimizer's vertex codec, version 0: each byte of a row against that of the row before, packed by sixteens. Trusts nothing.</summary>
    internal static class MeshoptVertices
    {
        private const int BlockBytes = 8192, MostRows = 256, Group = 16, LeastTail = 32;

        /// <exception cref="EcorcheException">DataLoss: it is no such array of `count` rows of `stride` bytes.</exception>
        public static byte[] Decode(ReadOnlySpan<byte> data, int count, int stride)
        {
            int tail = Math.Max(stride, LeastTail);
            if (data.Length < 1 + tail || data[0] != 0xA0) throw Bad();
            // Every sixteen bytes take two bits at least, which bounds what a few bytes can ask for.
            if ((long)count * stride > 64L * data.Length + 64L * stride * Group) throw Bad();
            var rows = new byte[count * stride];
            var last = data.Slice(data.Length - stride).ToArray();
            var from = data.Slice(1, data.Length - 1 - tail);
            int perBlock = Math.Min(BlockBytes / stride / Group * Group, MostRows);
            var column = new byte[MostRows];
            for (int first = 0; first < count; first += perBlock)
            {
                int some = Math.Min(perBlock, count - first);
                for (int k = 0; k < stride; ++k)
                {
                    from = Column(from, column.AsSpan(0, (some + Group - 1) / Group * Group));
                    byte value = last[k];
                    for (int i = 0; i < some; ++i)
                    {
                        value += (byte)((column[i] >> 1) ^ -(column[i] & 1));
                        rows[(first + i) * stride + k] = value;
                    }
                    last[k] = value;
                }
            }
            if (from.Length != 0) throw Bad();
            return rows;
        }

        /// <summary>Returns what is left of `from`.</summary>
        private static ReadOnlySpan<byte> Column(ReadOnlySpan<byte> from, Span<byte> to)
        {
            int groups = to.Length / Group, head = (groups + 3) / 4;
            if (from.Length < head) throw Bad();
            var kinds = from.Slice(0, head);
            from = from.Slice(head);
            for (int g = 0; g < groups; ++g)
            {
                int bits = 1 << ((kinds[g / 4] >> (g % 4 * 2)) & 3);
                var some = to.Slice(g * Group, Group);
                if (bits == 1) some.Clear();
                else from = Sixteen(from, bits, some);
            }
            return from;
        }

        /// <summary>Numbers of 2, 4 or 8 bits, the highest first; all ones stand for a whole byte behind them.</summary>
        private static ReadOnlySpan<byte> Sixteen(ReadOnlySpan<byte> from, int bits, Span<byte> to)
        {
            int packed = Group * bits / 8, next = packed, sentinel = (1 << bits) - 1;
            if (from.Length < packed) throw Bad();
            for (int i = 0; i < Group; ++i)
            {
                int at = i * bits, value = (from[at / 8] >> (8 - bits - at % 8)) & sentinel;
                if (bits < 8 && value == sentinel)
                {
                    if (next >= from.Length) throw Bad();
                    value = from[next++];
                }
                to[i] = (byte)value;
            }
            return from.Slice(next);
        }

        private static EcorcheException Bad() => EcorcheException.Damaged("skinning cannot be unpacked");
    }
}
