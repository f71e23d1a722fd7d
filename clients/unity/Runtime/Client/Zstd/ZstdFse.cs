// SPDX-License-Identifier: Apache-2.0

namespace Ecorche
{
    /// <summary>A decoding table of finite state entropy (RFC 8878, 4.1): by state, what it stands for and how the next state is found.</summary>
    internal sealed unsafe class ZstdFse
    {
        private const int LeastBits = 5, MostSymbols = 256;
        private readonly uint[] _bases;
        private readonly byte[] _extras;
        private readonly short[] _counts = new short[MostSymbols];
        private readonly int[] _next = new int[MostSymbols];
        private readonly int _mostBits, _mostSymbol;

        /// <param name="bases">By symbol: the least number that it stands for; null: the symbol itself, up to 255.</param>
        /// <param name="extras">By symbol: bits that follow it, of what is to be added.</param>
        public ZstdFse(int mostBits, uint[] bases, byte[] extras)
        {
            (_mostBits, _bases, _extras) = (mostBits, bases, extras);
            _mostSymbol = bases == null ? MostSymbols - 1 : bases.Length - 1;
            Entries = new ulong[1 << mostBits];
        }

        /// <summary>By state: the number (32 bits), its extra bits (8), the bits of the next state (8), and what those are added to (16).</summary>
        public ulong[] Entries { get; }

        /// <summary>Of a state.</summary>
        public int Bits { get; private set; }

        /// <summary>A distribution as it is written; returns its bytes. Up to four behind `size` may be read, and do not count.</summary>
        public int Read(byte* from, int size)
        {
            if (size < 1) throw ZstdDecoder.Wrong();
            int bits = (from[0] & 15) + LeastBits, bit = 4, symbol = 0;
            if (bits > _mostBits) throw ZstdDecoder.Wrong();
            for (int left = 1 << bits; left > 0;)
            {
                if (symbol > _mostSymbol || bit >> 3 >= size) throw ZstdDecoder.Wrong();
                // Of the numbers up to left + 1 the lower ones take a bit less.
                int wide = ZstdDecoder.HighBit((uint)left + 1) + 1, lower = (1 << (wide - 1)) - 1, few = (1 << wide) - 2 - left;
                int value = (int)(*(uint*)(from + (bit >> 3)) >> (bit & 7)) & (2 * lower + 1);
                bit += wide;
                if ((value & lower) < few)
                {
                    value &= lower;
                    --bit;
                }
                else if (value > lower)
                {
                    value -= few;
                }
                int count = value - 1;
                left -= count < 0 ? 1 : count;
                _counts[symbol++] = (short)count;
                for (int zeros = count == 0 ? 3 : 0; zeros == 3;)
                {
                    if (bit >> 3 >= size) throw ZstdDecoder.Wrong();
                    zeros = (*(ushort*)(from + (bit >> 3)) >> (bit & 7)) & 3;
                    bit += 2;
                    if (symbol + zeros > _mostSymbol + 1) throw ZstdDecoder.Wrong();
                    for (int i = 0; i < zeros; ++i) _counts[symbol++] = 0;
                }
            }
            int used = (bit + 7) >> 3;
            if (used > size) throw ZstdDecoder.Wrong();
            Spread(symbol, bits);
            return used;
        }

        /// <summary>A distribution that everybody knows.</summary>
        public ZstdFse Of(int bits, params short[] counts)
        {
            counts.CopyTo(_counts, 0);
            Spread(counts.Length, bits);
            return this;
        }

        /// <summary>One symbol alone, of no bits.</summary>
        public void Only(int symbol)
        {
            if (symbol > _mostSymbol) throw ZstdDecoder.Wrong();
            Bits = 0;
            Entries[0] = Told(symbol);
        }

        private ulong Told(int symbol) => _bases == null ? (uint)symbol : _bases[symbol] | (ulong)_extras[symbol] << 32;

        private void Spread(int symbols, int bits)
        {
            Bits = bits;
            int size = 1 << bits, high = size, step = (size >> 1) + (size >> 3) + 3, at = 0;
            for (int s = 0; s < symbols; ++s)
            {
                _next[s] = _counts[s] < 0 ? 1 : _counts[s];
                if (_counts[s] < 0) Entries[--high] = (ulong)s;
            }
            for (int s = 0; s < symbols; ++s)
            {
                for (int i = 0; i < _counts[s]; ++i)
                {
                    Entries[at] = (ulong)s;
                    do at = (at + step) & (size - 1);
                    while (at >= high);
                }
            }
            for (int state = 0; state < size; ++state)
            {
                int symbol = (int)Entries[state], next = _next[symbol]++, some = bits - ZstdDecoder.HighBit((uint)next);
                Entries[state] = Told(symbol) | (ulong)(uint)some << 40 | (ulong)(uint)((next << some) - size) << 48;
            }
        }
    }
}
