// SPDX-License-Identifier: Apache-2.0
using System;
using Ecorche;

/// <summary>Deltas as the protocol writes them, number by number, beside the package's; and bytes that are none.</summary>
internal static unsafe class DeltaChecks
{
    public static void Run(string[] words)
    {
        var random = new Random(7);
        for (int round = 0; round < 400; ++round)
        {
            int count = round % 3 == 0 ? 512 : random.Next(1, 513), stride = (count + 31) / 32 * 32;
            var data = Block(random, round, count);
            var key = new ushort[3 * stride];
            for (int i = 0; i < key.Length; ++i) key[i] = (ushort)(round % 2 == 0 ? random.Next(65536) : 30000 + random.Next(600));
            var planes = new ushort[3 * Deltas.Block];
            int end = Decode(data, key, stride, count, planes);
            Check.True(end == data.Length, "a block's end");
            for (int v = 0; v < count; ++v)
                for (int c = 0; c < 3; ++c)
                    Check.True(planes[c * Deltas.Block + v] == Slow(data, key, stride, count, v, c), "round " + round + " vertex " + v + " axis " + c);
            for (int cut = 0; cut < data.Length; cut += 1 + random.Next(40)) Refused(data.AsSpan(0, cut).ToArray(), key, stride, count, planes);
            data[round % 2 == 0 ? 0 : 1 + random.Next(3)] = (byte)random.Next(17, 255);
            Refused(data, key, stride, count, planes);
        }
        Console.WriteLine("400 blocks");
    }

    private static int Decode(byte[] data, ushort[] key, int stride, int count, ushort[] planes)
    {
        var room = new ulong[Deltas.Scratch];
        fixed (byte* d = data)
        fixed (ushort* k = key)
        fixed (ushort* p = planes)
        fixed (ulong* r = room)
            return Deltas.Decode(d, 0, data.Length, k, stride, count, r, p);
    }

    private static void Refused(byte[] data, ushort[] key, int stride, int count, ushort[] planes)
    {
        try
        {
            int end = Decode(data, key, stride, count, planes);
            Check.True(end <= data.Length, "reads beyond its end");
            if (data.Length > 0 && data[0] <= 9) return;  // a smaller width
            Check.True(data.Length > 0 && data[0] == 255, "a block without a header is read");
        }
        catch (EcorcheException error)
        {
            Check.True(error.Code == Code.DataLoss, error.Message);
        }
    }

    private static byte[] Block(Random random, int round, int count)
    {
        int rows = (count + 31) / 32, size = 34;
        var widths = new byte[3];
        for (int c = 0; c < 3; ++c)
        {
            widths[c] = (byte)(round < 17 ? round : random.Next(17));
            size += 64 * ((rows * widths[c] + 15) / 16);
        }
        var data = new byte[size];
        random.NextBytes(data);
        data[0] = (byte)(round % 11 == 10 ? 255 : round % 11);
        widths.CopyTo(data, 1);
        // -1 as an entry, whose product with -1 wraps.
        if (round % 5 == 0) new byte[] { 0, 0x80 }.CopyTo(data, 4 + 2 * (round % 9));
        return data;
    }

    private static ushort Slow(byte[] data, ushort[] key, int stride, int count, int v, int c)
    {
        int digits = data[0], rows = (count + 31) / 32, at = 34;
        for (int before = 0; before < c; ++before) at += 64 * ((rows * data[1 + before] + 15) / 16);
        int left = 0;
        for (int bit = 0; bit < data[1 + c]; ++bit)
        {
            int place = v / 32 * data[1 + c] + bit, word = at + 2 * (32 * (place / 16) + v % 32);
            left |= ((data[word + place % 16 / 8] >> (place % 8)) & 1) << bit;
        }
        Func<int, int> number = offset => data[offset] | data[offset + 1] << 8;
        ushort origin = (ushort)number(28 + 2 * c);
        if (digits == 255) return (ushort)(key[c * stride + v] - number(22 + 2 * c) + origin + left);
        short sum = 0;
        for (int j = 0; j < 3; ++j)
        {
            short x = (short)((short)(key[j * stride + v] - number(22 + 2 * j)) << (digits + 2)), m = (short)number(4 + 2 * (3 * c + j));
            sum += (short)((m * x + (1 << 14)) >> 15);
        }
        short half = (short)(digits > 0 ? 1 << (digits - 1) : 0);
        return (ushort)(((short)(sum + half) >> digits) + origin + left);
    }
}
