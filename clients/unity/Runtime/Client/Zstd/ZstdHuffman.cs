// SPDX-License-Identifier: Apache-2.0

namespace Ecorche
{
    /// <summary>Literals by Huffman's codes (RFC 8878, 4.2).</summary>
    internal sealed unsafe class ZstdHuffman
    {
        private const int MostBits = 11, MostWeightBits = 6, MostSymbols = 256;
        /// <summary>By the next bits: the symbol, and in the upper byte how many of them are its code.</summary>
        private readonly ushort[] _table = new ushort[1 << MostBits];
        private readonly byte[] _weights = new byte[MostSymbols];
        private readonly int[] _ranks = new int[MostBits + 2];
        private readonly ZstdFse _fse = new ZstdFse(MostWeightBits, null, null);
        private int _bits;

        /// <summary>Whether there is a table from a block before.</summary>
        public bool Holds { get; set; }

        /// <summary>A table as it is written; returns its bytes.</summary>
        public int Read(byte* from, int size)
        {
            Holds = false;
            if (size < 1) throw ZstdDecoder.Wrong();
            int head = from[0], symbols, used;
            if (head >= 128)
            {
                symbols = head - 127;
                used = 1 + (symbols + 1) / 2;
                if (used > size) throw ZstdDecoder.Wrong();
                for (int i = 0; i < symbols; ++i) _weights[i] = (byte)(i % 2 == 0 ? from[1 + i / 2] >> 4 : from[1 + i / 2] & 15);
            }
            else
            {
                used = 1 + head;
                if (used > size) throw ZstdDecoder.Wrong();
                symbols = ReadWeights(from + 1, head);
            }
            Fill(symbols);
            Holds = true;
            return used;
        }

        /// <summary>Two states in turn, until there are no bits.</summary>
        private int ReadWeights(byte* from, int size)
        {
            int head = _fse.Read(from, size), count = 0;
            var bits = new ZstdBits(from + head, size - head);
            ulong one = _fse.Entries[bits.ReadOrZeros(_fse.Bits)], other = _fse.Entries[bits.ReadOrZeros(_fse.Bits)];
            if (bits.Left < 0) throw ZstdDecoder.Wrong();
            while (true)
            {
                // The last symbol has no weight of its own.
                if (count >= MostSymbols - 2) throw ZstdDecoder.Wrong();
                _weights[count++] = (byte)one;
                one = _fse.Entries[(int)(one >> 48) + (int)bits.ReadOrZeros((int)(one >> 40) & 255)];
                (one, other) = (other, one);
                if (bits.Left >= 0) continue;
                _weights[count++] = (byte)one;
                return count;
            }
        }

        /// <summary>The table of `symbols` weights, and of one more symbol, which has what is left.</summary>
        private void Fill(int symbols)
        {
            uint sum = 0;
            System.Array.Clear(_ranks, 0, _ranks.Length);
            for (int s = 0; s < symbols; ++s)
            {
                int weight = _weights[s];
                if (weight > MostBits) throw ZstdDecoder.Wrong();
                ++_ranks[weight];
                if (weight > 0) sum += 1u << (weight - 1);
            }
            if (sum == 0) throw ZstdDecoder.Wrong();
            int bits = ZstdDecoder.HighBit(sum) + 1;
            uint left = (1u << bits) - sum;
            if (bits > MostBits || (left & (left - 1)) != 0) throw ZstdDecoder.Wrong();
            _weights[symbols] = (byte)(ZstdDecoder.HighBit(left) + 1);
            ++_ranks[_weights[symbols]];
            if (_ranks[1] < 2) throw ZstdDecoder.Wrong();
            _bits = bits;
            for (int weight = 1, at = 0; weight <= bits; ++weight)
            {
                int count = _ranks[weight];
                _ranks[weight] = at;
                at += count << (weight - 1);
            }
            for (int s = 0; s <= symbols; ++s)
            {
                int weight = _weights[s];
                if (weight == 0) continue;
                int end = _ranks[weight] + (1 << (weight - 1));
                for (int at = _ranks[weight]; at < end; ++at) _table[at] = (ushort)(s | (bits + 1 - weight) << 8);
                _ranks[weight] = end;
            }
        }

        /// <summary>One stream of exactly `count` symbols. There are eight bytes before `from` that may be read.</summary>
        public void Decode(byte* from, int size, byte* to, int count)
        {
            int left = new ZstdBits(from, size).Left, shift = 64 - _bits;
            byte* end = to + count;
            fixed (ushort* table = _table)
            {
                for (; to + 5 <= end; to += 5)
                {
                    if (left < 0) throw ZstdDecoder.Wrong();
                    // 57 bits at least, and a code has 11 at most.
                    int last = (left + 7) >> 3;
                    ulong next = *(ulong*)(from + last - 8) << (8 * last - left);
                    int a = table[next >> shift];
                    next <<= a >> 8;
                    int b = table[next >> shift];
                    next <<= b >> 8;
                    int c = table[next >> shift];
                    next <<= c >> 8;
                    int d = table[next >> shift];
                    next <<= d >> 8;
                    int e = table[next >> shift];
                    to[0] = (byte)a;
                    to[1] = (byte)b;
                    to[2] = (byte)c;
                    to[3] = (byte)d;
                    to[4] = (byte)e;
                    left -= (a >> 8) + (b >> 8) + (c >> 8) + (d >> 8) + (e >> 8);
                }
                for (; to < end; ++to)
                {
                    if (left < 0) throw ZstdDecoder.Wrong();
                    int last = (left + 7) >> 3;
                    int a = table[(*(ulong*)(from + last - 8) << (8 * last - left)) >> shift];
                    *to = (byte)a;
                    left -= a >> 8;
                }
            }
            if (left != 0) throw ZstdDecoder.Wrong();
        }
    }
}
