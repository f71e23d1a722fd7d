// SPDX-License-Identifier: Apache-2.0

namespace Ecorche
{
    /// <summary>Sequences (RFC 8878, 3.1.1.3.2): so many literals, then so many bytes of what came before.</summary>
    internal sealed unsafe class ZstdSequences
    {
        private const int Literals = 0, Offsets = 1, Matches = 2;
        private static readonly ZstdFse[] Known =
        {
            Empty(Literals).Of(6, 4, 3, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 2, 3, 2, 1, 1, 1, 1, 1, -1, -1, -1, -1),
            Empty(Offsets).Of(5, 1, 1, 1, 1, 1, 1, 2, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, -1, -1, -1, -1, -1),
            Empty(Matches).Of(6, 1, 4, 3, 2, 2, 2, 2, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
                1, 1, 1, 1, 1, 1, 1, -1, -1, -1, -1, -1, -1, -1),
        };

        private readonly ZstdFse[] _own = { Empty(Literals), Empty(Offsets), Empty(Matches) };
        /// <summary>Those of the last block that had sequences.</summary>
        private readonly ZstdFse[] _now = new ZstdFse[3];
        /// <summary>The last three distances.</summary>
        private uint _first, _second, _third;

        /// <summary>A frame knows nothing of the one before.</summary>
        public void Begin()
        {
            (_first, _second, _third) = (1, 4, 8);
            for (int k = 0; k < 3; ++k) _now[k] = null;
        }

        private static ZstdFse Empty(int kind)
        {
            if (kind == Offsets)
            {
                var powers = new uint[32];
                var bits = new byte[32];
                for (int code = 0; code < 32; ++code) (powers[code], bits[code]) = (1u << code, (byte)code);
                return new ZstdFse(8, powers, bits);
            }
            byte[] extras = kind == Literals
                ? new byte[] { 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 3, 3, 4, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16 }
                : new byte[]
                {
                    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
                    1, 1, 1, 1, 2, 2, 3, 3, 4, 4, 5, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16,
                };
            var bases = new uint[extras.Length];
            // Each begins where the one before ends.
            for (int code = 0; code < bases.Length; ++code)
                bases[code] = code == 0 ? (kind == Literals ? 0u : 3u) : bases[code - 1] + (1u << extras[code - 1]);
            return new ZstdFse(9, bases, extras);
        }

        /// <summary>Writes a block behind the `filled` bytes of `to`, `limit` at most; returns how many there are then. Eight more may be written.</summary>
        public int Run(byte* from, int size, byte* literals, int literalCount, byte* to, int filled, int limit)
        {
            byte* end = from + size;
            int count = ReadCount(ref from, end);
            byte* written = to + filled;
            byte* last = to + limit;
            byte* literalsEnd = literals + literalCount;
            if (count == 0)
            {
                if (from != end) throw ZstdDecoder.Wrong();
            }
            else
            {
                ReadTables(ref from, end);
                Write(new ZstdBits(from, (int)(end - from)), count, ref literals, literalsEnd, to, ref written, last);
            }
            long rest = literalsEnd - literals;
            if (rest > last - written) throw ZstdDecoder.Wrong();
            System.Buffer.MemoryCopy(literals, written, rest, rest);
            return (int)(written + rest - to);
        }

        private static int ReadCount(ref byte* from, byte* end)
        {
            if (from >= end) throw ZstdDecoder.Wrong();
            int head = *from++;
            if (head < 128) return head;
            if (end - from < (head == 255 ? 2 : 1)) throw ZstdDecoder.Wrong();
            if (head < 255) return ((head - 128) << 8) + *from++;
            from += 2;
            return from[-2] + (from[-1] << 8) + 0x7F00;
        }

        private void ReadTables(ref byte* from, byte* end)
        {
            if (from >= end) throw ZstdDecoder.Wrong();
            int modes = *from++;
            if ((modes & 3) != 0) throw ZstdDecoder.Wrong();
            for (int kind = 0; kind < 3; ++kind)
            {
                switch ((modes >> (6 - 2 * kind)) & 3)
                {
                    case 0:
                        _now[kind] = Known[kind];
                        break;
                    case 1:
                        if (from >= end) throw ZstdDecoder.Wrong();
                        _own[kind].Only(*from++);
                        _now[kind] = _own[kind];
                        break;
                    case 2:
                        from += _own[kind].Read(from, (int)(end - from));
                        _now[kind] = _own[kind];
                        break;
                    default:
                        if (_now[kind] == null) throw ZstdDecoder.Wrong();
                        break;
                }
            }
        }

        private void Write(ZstdBits bits, int count, ref byte* literals, byte* literalsEnd, byte* to, ref byte* written, byte* last)
        {
            fixed (ulong* ofLiterals = _now[Literals].Entries, ofOffsets = _now[Offsets].Entries, ofMatches = _now[Matches].Entries)
            {
                ulong l = ofLiterals[bits.Read(_now[Literals].Bits)], o = ofOffsets[bits.Read(_now[Offsets].Bits)], m = ofMatches[bits.Read(_now[Matches].Bits)];
                byte* at = written;
                byte* next = literals;
                for (int left = count; ;)
                {
                    uint value = (uint)o + bits.Read((int)(o >> 32) & 255);
                    uint match = (uint)m + bits.Read((int)(m >> 32) & 255), some = (uint)l + bits.Read((int)(l >> 32) & 255);
                    uint distance = Distance(value, some);
                    if (--left > 0)
                    {
                        l = ofLiterals[(int)(l >> 48) + (int)bits.Read((int)(l >> 40) & 255)];
                        m = ofMatches[(int)(m >> 48) + (int)bits.Read((int)(m >> 40) & 255)];
                        o = ofOffsets[(int)(o >> 48) + (int)bits.Read((int)(o >> 40) & 255)];
                    }
                    if (bits.Left < 0 || some > literalsEnd - next || (long)some + match > last - at) throw ZstdDecoder.Wrong();
                    Copy(next, at, at + some);
                    next += some;
                    at += some;
                    if (distance == 0 || distance > at - to) throw ZstdDecoder.Wrong();
                    Repeat(at, distance, at + match);
                    at += match;
                    if (left == 0) break;
                }
                if (bits.Left != 0) throw ZstdDecoder.Wrong();
                written = at;
                literals = next;
            }
        }

        /// <summary>How far back, by a number and how many literals come first; the last three distances follow.</summary>
        private uint Distance(uint value, uint some)
        {
            if (value > 3)
            {
                (_third, _second, _first) = (_second, _first, value - 3);
                return _first;
            }
            uint which = some == 0 ? value + 1 : value;
            if (which == 1) return _first;
            uint distance = which == 2 ? _second : which == 3 ? _third : _first - 1;
            if (which != 2) _third = _second;
            (_second, _first) = (_first, distance);
            return distance;
        }

        /// <summary>Eight bytes at once: up to seven behind `end` are written as well.</summary>
        private static void Copy(byte* from, byte* to, byte* end)
        {
            for (; to < end; from += 8, to += 8) *(ulong*)to = *(ulong*)from;
        }

        /// <summary>What stands `distance` before, which may be what is being written; likewise.</summary>
        private static void Repeat(byte* to, uint distance, byte* end)
        {
            byte* from = to - distance;
            if (distance < 8)
            {
                // A pattern of less than eight bytes is one of a multiple of its length, too.
                for (int i = 0; i < 8; ++i) to[i] = from[i];
                to += 8;
                from = to - (8 + distance - 1) / distance * distance;
            }
            Copy(from, to, end);
        }
    }
}
