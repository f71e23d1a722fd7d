// SPDX-License-Identifier: Apache-2.0
using System;
using System.Buffers.Binary;

namespace Ecorche
{
    /// <summary>One zstd frame (RFC 8878) of a size that is known before, in managed code: no platform of Unity's has the library.</summary>
    /// <remarks>
    /// Trusts nothing. Its blocks are looked at first: nothing is made room for that the bytes cannot hold, and nothing may follow. A checksum
    /// is passed over. Blocks are copied into a room with space on both sides, so that numbers may be read eight bytes at once. Allocates where
    /// a frame is larger than those before. Tests hold this against the library.
    /// </remarks>
    internal sealed unsafe class ZstdDecoder
    {
        /// <summary>Behind what comes out, where it writes as well.</summary>
        public const int Slack = 16;
        private const uint Magic = 0xFD2FB528;
        private const int MostBlock = 1 << 17, MostBytes = 0x7FFFFFC7 - Slack, Before = 16, Behind = 16;
        private const int Raw = 0, OneByte = 1, Compressed = 2, Treeless = 3;

        private readonly byte[] _room = new byte[Before + MostBlock + Behind], _literals = new byte[MostBlock + Behind];
        private readonly ZstdHuffman _huffman = new ZstdHuffman();
        private readonly ZstdSequences _sequences = new ZstdSequences();
        /// <summary>Bytes of a block of this frame, before and after.</summary>
        private int _most;

        internal static EcorcheException Wrong() => EcorcheException.Damaged("a zstd frame with a block that is none");

        /// <summary>The row of the highest bit of a number above 0.</summary>
        internal static int HighBit(uint number)
        {
            int bit = 0;
            for (int half = 16; half > 0; half >>= 1)
            {
                if (number >> half == 0) continue;
                number >>= half;
                bit += half;
            }
            return bit;
        }

        /// <summary>Writes `size` bytes into `to`, which grows to that and <see cref="Slack"/>.</summary>
        /// <exception cref="EcorcheException">DataLoss: it is no whole frame of so many bytes.</exception>
        public void Decode(ReadOnlySpan<byte> packed, int size, ref byte[] to)
        {
            int at = Check(packed, size);
            if (to.Length < size + Slack) to = new byte[size + Slack];
            _huffman.Holds = false;
            _sequences.Begin();
            int filled = 0;
            fixed (byte* from = packed, room = _room, literals = _literals, written = to)
            {
                for (bool last = false; !last;)
                {
                    int head = Head(packed, at), type = (head >> 1) & 3, bytes = head >> 3, limit = filled + Math.Min(_most, size - filled);
                    last = (head & 1) != 0;
                    at += 3;
                    if (type != Compressed && bytes > limit - filled) throw EcorcheException.Damaged("a zstd frame holds more than it says");
                    if (type == Raw)
                    {
                        Buffer.MemoryCopy(from + at, written + filled, bytes, bytes);
                    }
                    else if (type == OneByte)
                    {
                        new Span<byte>(written + filled, bytes).Fill(packed[at]);
                    }
                    else
                    {
                        Buffer.MemoryCopy(from + at, room + Before, bytes, bytes);
                        filled = Block(room + Before, bytes, literals, written, filled, limit);
                        at += bytes;
                        continue;
                    }
                    filled += bytes;
                    at += type == OneByte ? 1 : bytes;
                }
            }
            if (filled != size) throw EcorcheException.Damaged("a zstd frame holds " + filled + " bytes, not " + size);
        }

        private static int Head(ReadOnlySpan<byte> packed, int at) => packed[at] | packed[at + 1] << 8 | packed[at + 2] << 16;

        /// <summary>The frame's head and those of all its blocks. Where the first one begins.</summary>
        private int Check(ReadOnlySpan<byte> packed, int size)
        {
            if (packed.Length < 6 || BinaryPrimitives.ReadUInt32LittleEndian(packed) != Magic) throw EcorcheException.Damaged("voxels are no zstd frame");
            int flags = packed[4], single = (flags >> 5) & 1, sizeBytes = (flags >> 6) == 0 ? single : 1 << (flags >> 6), at = 5 + (1 - single);
            if ((flags & 0b1011) != 0) throw EcorcheException.Damaged("a zstd frame with a dictionary, or of another version");
            if (packed.Length < at + sizeBytes) throw Short();
            long window = single == 1 ? size : (8L + (packed[5] & 7)) << (7 + (packed[5] >> 3));
            _most = (int)Math.Min(window, MostBlock);
            ulong told = sizeBytes == 2 ? 256u : 0u;
            for (int i = 0; i < sizeBytes; ++i) told += (ulong)packed[at + i] << (8 * i);
            if (sizeBytes == 0 || told != (ulong)size) throw EcorcheException.Damaged("a zstd frame that tells of " + told + " bytes, not " + size);
            at += sizeBytes;
            int first = at;
            long most = 0;
            for (bool last = false; !last;)
            {
                if (packed.Length - at < 3) throw Short();
                int head = Head(packed, at), type = (head >> 1) & 3, bytes = head >> 3, held = type == OneByte ? 1 : bytes;
                if (type == 3 || bytes > _most) throw EcorcheException.Damaged("a zstd frame with a block of no kind or size");
                if (packed.Length - at - 3 < held) throw Short();
                at += 3 + held;
                most += type == Compressed ? _most : bytes;
                last = (head & 1) != 0;
            }
            if (at + ((flags & 4) != 0 ? 4 : 0) != packed.Length) throw Short();
            // What the size is believed for.
            if (size > Math.Min(most, MostBytes)) throw EcorcheException.Damaged("a zstd frame of " + packed.Length + " bytes cannot hold " + size);
            return first;
        }

        private static EcorcheException Short() => EcorcheException.Damaged("a zstd frame is cut short, or something follows it");

        /// <summary>Literals, and what is done with them. How much is filled then.</summary>
        private int Block(byte* from, int size, byte* literals, byte* to, int filled, int limit)
        {
            if (size < 2) throw Wrong();
            int type = from[0] & 3, form = (from[0] >> 2) & 3;
            if (type == Raw || type == OneByte)
            {
                int bytes = form == 1 ? 2 : form == 3 ? 3 : 1;
                int count = (int)(*(uint*)from & (0xFFFFFFu >> (24 - 8 * bytes))) >> (bytes == 1 ? 3 : 4), held = type == Raw ? count : 1;
                if (count > MostBlock || size - bytes < held) throw Wrong();
                byte* at = from + bytes;
                if (type == OneByte)
                {
                    new Span<byte>(literals, count).Fill(*at);
                    return _sequences.Run(at + 1, size - bytes - 1, literals, count, to, filled, limit);
                }
                return _sequences.Run(at + count, size - bytes - count, at, count, to, filled, limit);
            }
            int wide = form < 2 ? 10 : form == 2 ? 14 : 18, header = form < 2 ? 3 : form + 2;
            if (size < header) throw Wrong();
            ulong numbers = *(ulong*)from >> 4;
            int some = (int)numbers & ((1 << wide) - 1), packed = (int)(numbers >> wide) & ((1 << wide) - 1);
            if (some > MostBlock || size - header < packed) throw Wrong();
            byte* start = from + header;
            byte* end = start + packed;
            if (type == Compressed) start += _huffman.Read(start, packed);
            else if (!_huffman.Holds) throw Wrong();
            if (form == 0) _huffman.Decode(start, (int)(end - start), literals, some);
            else FourStreams(start, end, literals, some);
            return _sequences.Run(end, (int)(from + size - end), literals, some, to, filled, limit);
        }

        private void FourStreams(byte* start, byte* end, byte* literals, int count)
        {
            const int jumps = 6;
            int each = (count + 3) / 4;
            if (end - start < jumps || count < 3 * each) throw Wrong();
            ushort* sizes = (ushort*)start;
            start += jumps;
            for (int s = 0; s < 4; ++s)
            {
                int size = s < 3 ? sizes[s] : (int)(end - start);
                if (size > end - start) throw Wrong();
                _huffman.Decode(start, size, literals + s * each, s < 3 ? each : count - 3 * each);
                start += size;
            }
        }
    }
}
