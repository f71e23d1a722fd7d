// SPDX-License-Identifier: Apache-2.0
using System;
using System.Diagnostics;
using System.IO;
using Ecorche;

/// <summary>zstd FILE: frames one after another, each behind the size that it should hold and its own (i32); prints what they hold, or that it is
/// refused. zstd FILE bench: of the last of them the best milliseconds.</summary>
internal static class ZstdChecks
{
    public static void Run(string[] words)
    {
        var decoder = new ZstdDecoder();
        var to = new byte[0];
        using (var file = new BinaryReader(File.OpenRead(words[0])))
        {
            while (file.BaseStream.Position < file.BaseStream.Length)
            {
                int size = file.ReadInt32();
                var packed = file.ReadBytes(file.ReadInt32());
                try
                {
                    decoder.Decode(packed, size, ref to);
                    Console.WriteLine(Check.Hash(to.AsSpan(0, size)));
                    if (words.Length > 1 && file.BaseStream.Position == file.BaseStream.Length) Time(decoder, packed, size, ref to);
                }
                catch (EcorcheException error)
                {
                    Check.True(error.Code == Code.DataLoss, error.Message);
                    Console.WriteLine("refused " + error.Message);
                }
            }
        }
    }

    private static void Time(ZstdDecoder decoder, byte[] packed, int size, ref byte[] to)
    {
        double best = double.PositiveInfinity;
        long before = 0;
        for (int i = 0; i < 20; ++i)
        {
            if (i == 1) before = GC.GetAllocatedBytesForCurrentThread();
            var watch = Stopwatch.StartNew();
            decoder.Decode(packed, size, ref to);
            best = Math.Min(best, watch.Elapsed.TotalMilliseconds);
        }
        Console.WriteLine(best.ToString("F2") + " ms, " + (GC.GetAllocatedBytesForCurrentThread() - before) / 19 + " bytes allocated");
    }
}
