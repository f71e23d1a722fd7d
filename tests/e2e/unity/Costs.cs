// SPDX-License-Identifier: Apache-2.0
using System;
using System.Diagnostics;
using System.IO;
using System.Net;
using System.Net.Sockets;
using System.Threading;
using Ecorche;
using Ecorche.Wire;

internal static partial class Check
{
    /// <summary>allocate ADDRESS FRAMES: what frames and poses allocate once all rooms are as large as they need be.</summary>
    private static void Allocate(string[] words)
    {
        int frames = int.Parse(words[1]);
        foreach (var encoding in new[] { Encoding.F32, Encoding.U16, Encoding.U16Delta })
        {
            using (var client = Client.Connect(words[0]))
            {
                client.Open();
                var stream = client.Subscribe(new StreamOptions { Encoding = encoding });
                var pose = client.NewPose();
                long before = 0, sum = 0;
                int collections = 0;
                // The first third fills pools, and lets a keyframe come.
                for (int i = 0; i < frames + frames / 2; ++i)
                {
                    if (i == frames / 2)
                    {
                        GC.Collect();
                        collections = GC.CollectionCount(0);
                        before = GC.GetAllocatedBytesForCurrentThread();
                    }
                    ulong sent = client.SendPose(pose.SetAngle("elbow_left", "flexion", 0.5 + 0.4 * Math.Sin(0.1 * i)));
                    for (bool shown = false; !shown;)
                    {
                        True(client.Poll(20000).Kind != EventKind.None, "a frame");
                        var frame = stream.Take();
                        if (frame == null) continue;
                        shown = frame.PoseSequence >= sent;
                        sum += frame.Tissues.Length;
                    }
                }
                long bytes = GC.GetAllocatedBytesForCurrentThread() - before;
                collections = GC.CollectionCount(0) - collections;
                Console.WriteLine(encoding + " " + bytes + " bytes in " + frames + " frames, " + collections + " collections");
                True(sum > 0 && bytes == 0 && collections == 0, "frames allocate");
            }
        }
    }

    /// <summary>bench FILE: best milliseconds of a frame by layout, of frames as Replay reads them; the last one is decoded again and again.</summary>
    private static void Bench(string[] words)
    {
        foreach (var layout in new[] { VertexLayout.Packed, VertexLayout.Float })
        {
            using (var file = File.OpenRead(words[0]))
            {
                var bytes = new FrameBytes();
                True(bytes.Read(file), "a model");
                var body = new Body(Read(bytes).ModelOpened, bytes);
                True(bytes.Read(file), "a subscription");
                var stream = new MeshStream(new StreamOptions { Layout = layout }, body);
                stream.Begin(Read(bytes).Subscribed, bytes);
                var told = new Envelope();
                while (bytes.Read(file))
                {
                    told = Read(bytes);
                    stream.Decode(told.MeshFrame, bytes);
                    if (file.Position == file.Length) break;
                }
                double best = double.PositiveInfinity;
                for (int i = 0; i < 200; ++i)
                {
                    var watch = Stopwatch.StartNew();
                    var reader = new WireReader(bytes.Envelope);
                    told.Read(ref reader);
                    stream.Decode(told.MeshFrame, bytes);
                    best = Math.Min(best, watch.Elapsed.TotalMilliseconds);
                }
                long vertices = 0;
                foreach (var tissue in stream.Take().Tissues) vertices += tissue.Count;
                Console.WriteLine(layout + " " + vertices + " " + told.MeshFrame.Encoding + " " + best.ToString("F3"));
            }
        }
    }

    /// <summary>No beginning of an envelope is one, but where a field ends.</summary>
    private static void Cut(string[] words)
    {
        var envelope = new Envelope { RequestId = 3, HasPing = true };
        envelope.Ping.Data = new byte[68];
        var writer = new WireWriter();
        writer.Begin();
        envelope.Write(writer);
        var whole = writer.Written.ToArray();
        int refused = 0;
        for (int size = 0; size < whole.Length; ++size)
        {
            var read = new Envelope();
            try
            {
                var reader = new WireReader(whole.AsSpan(0, size));
                read.Read(ref reader);
                True(size == 0 || size == 2 && read.RequestId == 3, "an envelope of " + size + " bytes is read");
            }
            catch (EcorcheException error)
            {
                True(error.Code == Code.DataLoss, error.Message);
                ++refused;
            }
        }
        var last = new WireReader(whole);
        var back = new Envelope();
        back.Read(ref last);
        True(back.HasPing && back.Ping.Data.Length == 68 && back.RequestId == 3, "the whole envelope");
        Console.WriteLine("cut " + refused + " times");
    }

    /// <summary>hostile ROUNDS: a server that lies. Whatever it says, the client tells an EcorcheException, and soon.</summary>
    private static void Hostile(string[] words)
    {
        int rounds = int.Parse(words[0]);
        var listener = new TcpListener(IPAddress.Loopback, 0);
        listener.Start();
        var random = new Random(11);
        int refused = 0;
        for (int round = 0; round < rounds; ++round)
        {
            var lie = Lie(random, round);
            var server = new Thread(() =>
            {
                using (var socket = listener.AcceptSocket())
                {
                    socket.Receive(new byte[4096]);
                    socket.Send(lie);
                    socket.Shutdown(SocketShutdown.Send);
                    while (socket.Receive(new byte[4096]) > 0) { }
                }
            });
            server.Start();
            try
            {
                using (var client = Client.Connect("127.0.0.1:" + ((IPEndPoint)listener.LocalEndpoint).Port, new ClientOptions { Timeout = 5 }))
                    client.Open();
            }
            catch (EcorcheException error)
            {
                ++refused;
                True(error.Message.Length > 0, "a message");
            }
            server.Join();
        }
        True(refused == rounds, "every lie is refused, not " + refused);
        Console.WriteLine("refused " + refused);
    }

    private static byte[] Lie(Random random, int round)
    {
        var bytes = new byte[random.Next(1, 300)];
        random.NextBytes(bytes);
        if (round % 2 == 0 || bytes.Length < 32) return bytes;
        // A head that holds, then anything.
        int envelope = random.Next(1, bytes.Length - 15);
        BitConverter.GetBytes(round % 4 == 1 ? envelope : 60000000).CopyTo(bytes, 0);
        BitConverter.GetBytes(round % 8 == 1 ? 0 : 1 << 30).CopyTo(bytes, 4);
        for (int i = 8 + envelope; i < (8 + envelope + 15) / 16 * 16 && i < bytes.Length; ++i) bytes[i] = 0;
        return bytes;
    }
}
