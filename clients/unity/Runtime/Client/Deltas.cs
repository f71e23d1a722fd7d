// SPDX-License-Identifier: Apache-2.0
using System;

namespace Ecorche
{
    /// <summary>ENCODING_U16_DELTA (docs/reference/protocol.md, "Deltas"): a tissue's numbers from those of a keyframe.</summary>
    /// <remarks>
    /// Plain 64-bit arithmetic, since neither Mono nor IL2CPP offers vectors of 16-bit numbers: two coordinates go through one multiplication,
    /// in the low half of each 32 bits. A product m x, both of 16 bits with a sign, has 31 bits and a sign; a constant beside it makes it
    /// positive, so that the lower one takes nothing from the upper one. Even and odd vertices of four are taken apart, and put together again.
    /// Tests hold this against the sum as the protocol writes it.
    /// </remarks>
    internal static unsafe class Deltas
    {
        public const int Block = 512;
        private const int Lanes = 32, Header = 34, MovedOnly = 255, MostDigits = 9, Quads = Block / 4;
        /// <summary>The lower 16 bits of each half.</summary>
        private const ulong Low = 0x0000FFFF0000FFFF;
        /// <summary>Where the 16 bits of a product stand, 15 behind the point dropped.</summary>
        private const ulong Whole = 0x7FFF80007FFF8000;
        private const ulong Each = 0x0001000100010001;
        private const ulong Both = 0x0000000100000001;

        /// <summary>What <see cref="Decode"/> needs: coordinates of a block, even and odd apart, three axes.</summary>
        public const int Scratch = 6 * Quads;

        /// <summary>One block: writes three planes of numbers, <see cref="Block"/> apart, from those of the keyframe.</summary>
        /// <param name="bytes">The tissue's array, `size` long; the block begins at `at`.</param>
        /// <param name="key">The block's first x in the keyframe; y and z follow `stride` numbers apart. There is room to a multiple of 32.</param>
        /// <param name="count">Vertices: a whole block, or what is left.</param>
        /// <param name="room">Of <see cref="Scratch"/> numbers.</param>
        /// <returns>Where the next block begins.</returns>
        /// <exception cref="EcorcheException">DataLoss: it is no block.</exception>
        public static int Decode(byte* bytes, int at, int size, ushort* key, int stride, int count, ulong* room, ushort* to)
        {
            if (size - at < Header) throw EcorcheException.Damaged("the deltas end too early");
            byte* head = bytes + at;
            int digits = head[0], rows = (count + Lanes - 1) / Lanes;
            if (digits > MostDigits && digits != MovedOnly) throw EcorcheException.Damaged("a block of deltas has no header");
            at += Header;
            short* matrix = (short*)(head + 4);
            ushort* centre = (ushort*)(head + 22);
            ushort* origin = (ushort*)(head + 28);
            if (digits != MovedOnly)
                for (int c = 0; c < 3; ++c) Spread((ulong*)(key + c * stride), 8 * rows, digits, centre[c], room + 2 * c * Quads);
            for (int c = 0; c < 3; ++c)
            {
                int width = head[1 + c];
                if (width > 16) throw EcorcheException.Damaged("a block of deltas has no header");
                int words = 2 * Lanes * ((rows * width + 15) / 16);
                if (size - at < words) throw EcorcheException.Damaged("the deltas end too early");
                ulong* plane = (ulong*)(to + c * Block);
                Unpack((ushort*)(bytes + at), rows, width, plane);
                at += words;
                if (digits == MovedOnly) Move((ulong*)(key + c * stride), 8 * rows, (ushort)(origin[c] - centre[c]), plane);
                else Turn(room, 8 * rows, digits, matrix + 3 * c, origin[c], plane);
            }
            return at;
        }

        /// <summary>x = (key - centre) &lt;&lt; (digits + 2), plus 2^15 so that it is positive: the even ones of four, then the odd ones.</summary>
        private static void Spread(ulong* key, int quads, int digits, ushort centre, ulong* x)
        {
            int shift = digits + 2;
            ulong add = (ushort)(0x8000 - (centre << shift)) * Both;
            for (ulong* end = key + quads; key < end; key += 2, x += 2)
            {
                ulong a = key[0], b = key[1];
                x[0] = (((a & Low) << shift) + add) & Low;
                x[1] = (((b & Low) << shift) + add) & Low;
                x[Quads] = ((((a >> 16) & Low) << shift) + add) & Low;
                x[Quads + 1] = ((((b >> 16) & Low) << shift) + add) & Low;
            }
        }

        /// <summary>What is left of an axis after the map: lane l of row r has `width` bits, lowest first, in its words, each 32 lanes wide.</summary>
        private static void Unpack(ushort* words, int rows, int width, ulong* left)
        {
            if (width == 0)
            {
                for (int q = 0; q < 8 * rows; ++q) left[q] = 0;
                return;
            }
            uint wanted = (1u << width) - 1;
            for (int r = 0; r < rows; ++r, left += 8)
            {
                int bit = r * width, under = bit & 15;
                ulong* word = (ulong*)(words + Lanes * (bit >> 4));
                ulong mask = (wanted & (0xFFFFu >> under)) * Each;
                if (under + width <= 16)
                {
                    // Written out, here and below: Mono leaves loops as they are, and counting to eight costs as much as this does.
                    left[0] = (word[0] >> under) & mask;
                    left[1] = (word[1] >> under) & mask;
                    left[2] = (word[2] >> under) & mask;
                    left[3] = (word[3] >> under) & mask;
                    left[4] = (word[4] >> under) & mask;
                    left[5] = (word[5] >> under) & mask;
                    left[6] = (word[6] >> under) & mask;
                    left[7] = (word[7] >> under) & mask;
                    continue;
                }
                int over = 16 - under;
                ulong rest = ((0xFFFFu << over) & wanted) * Each;
                left[0] = ((word[0] >> under) & mask) | ((word[8] << over) & rest);
                left[1] = ((word[1] >> under) & mask) | ((word[9] << over) & rest);
                left[2] = ((word[2] >> under) & mask) | ((word[10] << over) & rest);
                left[3] = ((word[3] >> under) & mask) | ((word[11] << over) & rest);
                left[4] = ((word[4] >> under) & mask) | ((word[12] << over) & rest);
                left[5] = ((word[5] >> under) & mask) | ((word[13] << over) & rest);
                left[6] = ((word[6] >> under) & mask) | ((word[14] << over) & rest);
                left[7] = ((word[7] >> under) & mask) | ((word[15] << over) & rest);
            }
        }

        /// <summary>number = key + by + left.</summary>
        private static void Move(ulong* key, int quads, ushort by, ulong* numbers)
        {
            ulong add = by * Both;
            for (int q = 0; q < quads; ++q)
            {
                ulong four = key[q], left = numbers[q];
                ulong even = (four & Low) + add + (left & Low), odd = ((four >> 16) & Low) + add + ((left >> 16) & Low);
                numbers[q] = (even & Low) | ((odd & Low) << 16);
            }
        }

        /// <summary>number = ((sum of the row's products) + half &gt;&gt; digits) + origin + left.</summary>
        private static void Turn(ulong* x, int quads, int digits, short* row, ushort origin, ulong* numbers)
        {
            // The sum is taken with 2^15 added, so that its shift needs no sign.
            uint half = digits > 0 ? 1u << (digits - 1) : 0;
            ulong m0 = (ulong)row[0], m1 = (ulong)row[1], m2 = (ulong)row[2];
            ulong c0 = Beside(row[0], (half + 0x8000) << 15), c1 = Beside(row[1], 0), c2 = Beside(row[2], 0);
            int shift = 15 + digits;
            ulong kept = (0xFFFFu >> digits) * Both, add = (ushort)(origin - (0x8000 >> digits)) * Both;
            // Two at once, at distances that are known: Mono computes each address that is not, and fetches every constant anew in a round.
            for (ulong* end = numbers + quads; numbers < end; numbers += 2, x += 2)
            {
                ulong left = numbers[0];
                ulong even = ((m0 * x[0] + c0) & Whole) + ((m1 * x[2 * Quads] + c1) & Whole) + ((m2 * x[4 * Quads] + c2) & Whole);
                ulong odd = ((m0 * x[Quads] + c0) & Whole) + ((m1 * x[3 * Quads] + c1) & Whole) + ((m2 * x[5 * Quads] + c2) & Whole);
                even = ((even >> shift) & kept) + add + (left & Low);
                odd = ((odd >> shift) & kept) + add + ((left >> 16) & Low);
                numbers[0] = (even & Low) | ((odd & Low) << 16);
                left = numbers[1];
                even = ((m0 * x[1] + c0) & Whole) + ((m1 * x[2 * Quads + 1] + c1) & Whole) + ((m2 * x[4 * Quads + 1] + c2) & Whole);
                odd = ((m0 * x[Quads + 1] + c0) & Whole) + ((m1 * x[3 * Quads + 1] + c1) & Whole) + ((m2 * x[5 * Quads + 1] + c2) & Whole);
                even = ((even >> shift) & kept) + add + (left & Low);
                odd = ((odd >> shift) & kept) + add + ((left >> 16) & Low);
                numbers[1] = (even & Low) | ((odd & Low) << 16);
            }
        }

        /// <summary>For m (x + 2^15): takes m 2^15 off, rounds, and keeps it from 0 to 2^32, in both halves; 31 bits count.</summary>
        private static ulong Beside(short m, uint more)
        {
            uint wanted = ((uint)(-m * 0x8000) + 0x4000 + more) & 0x7FFFFFFF;
            return (m < 0 ? wanted | 0x80000000 : wanted) * Both;
        }
    }
}
