// SPDX-License-Identifier: Apache-2.0
// A program that speaks to a server by the package's client, engine-free: what unity_test.py asks for, as JSON lines. Run under Mono.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Runtime.InteropServices;
using System.Security.Cryptography;
using System.Threading;
using Ecorche;
using Ecorche.Wire;

internal static partial class Check
{
    private static readonly Dictionary<string, Action<string[]>> Commands = new Dictionary<string, Action<string[]>>
    {
        ["replay"] = Replay, ["live"] = Live, ["deltas"] = DeltaChecks.Run, ["space"] = SpaceChecks.Run, ["drive"] = SpaceChecks.Drive, ["follow"] = SpaceChecks.Follow, ["skin"] = SkinChecks.Run, ["resume"] = Resume,
        ["thread"] = ThreadChecks.Run, ["refused"] = Refused, ["allocate"] = Allocate, ["volume"] = ShowVolume, ["slices"] = SliceChecks.Run, ["hostile"] = Hostile, ["cut"] = Cut, ["native"] = NativeChecks.Run,
        ["bench"] = Bench, ["leave"] = Leave, ["replaced"] = Replaced, ["probes"] = Probes, ["zstd"] = ZstdChecks.Run,
    };

    private static int Main(string[] words)
    {
        CultureInfo.DefaultThreadCurrentCulture = CultureInfo.InvariantCulture;
        Thread.CurrentThread.CurrentCulture = CultureInfo.InvariantCulture;
        try
        {
            Commands[words[0]](words.Skip(1).ToArray());
            return 0;
        }
        catch (EcorcheException error)
        {
            Console.WriteLine("error " + error.Code + " " + error.Message);
            return 1;
        }
    }

    public static void True(bool holds, string what)
    {
        if (!holds) throw new Exception("wrong: " + what);
    }

    public static string Hash(ReadOnlySpan<byte> bytes)
    {
        using (var sha = SHA256.Create()) return BitConverter.ToString(sha.ComputeHash(bytes.ToArray())).Replace("-", "").ToLowerInvariant();
    }

    public static ClientOptions Options(string[] words, int from)
    {
        var options = new ClientOptions();
        for (int i = from; i + 1 < words.Length; i += 2)
        {
            if (words[i] == "--token") options.Token = words[i + 1];
            if (words[i] == "--authorities") options.Authorities = File.ReadAllText(words[i + 1]);
            if (words[i] == "--tls") options.Tls = true;
            if (words[i] == "--timeout") options.Timeout = double.Parse(words[i + 1]);
        }
        return options;
    }

    /// <summary>Waits for a frame of this pose or a newer one.</summary>
    public static BodyFrame Wait(Client client, MeshStream stream, ulong sequence, double seconds = 20)
    {
        BodyFrame last = null;
        for (var until = DateTime.UtcNow.AddSeconds(seconds); DateTime.UtcNow < until;)
        {
            var came = client.Poll(100);
            if (came.Kind == EventKind.Pose && came.Code != Code.Ok) throw new EcorcheException(came.Code, came.Message);
            last = stream.Take() ?? last;
            if (last != null && last.PoseSequence >= sequence) return last;
        }
        throw new Exception("no frame of pose " + sequence);
    }

    /// <summary>x, y and z of a frame's tissue as three floats each, and its normals.</summary>
    public static byte[] Positions(TissueVertices tissue)
    {
        var floats = tissue.Floats;
        var three = new float[3 * tissue.Count];
        for (int v = 0; v < tissue.Count; ++v) floats.Slice(4 * v, 3).CopyTo(three.AsSpan(3 * v));
        return MemoryMarshal.AsBytes<float>(three).ToArray();
    }

    /// <summary>replay FILE LAYOUT TISSUES LEVEL REGION OUT: frames as they came over a wire, one after another (ModelOpened, Subscribed, then
    /// MeshFrames); prints what they hold, and writes the last frame's normals, three i8 each, into OUT/NAME.normals.</summary>
    private static void Replay(string[] words)
    {
        var options = new StreamOptions { Space = Ecorche.Space.LpsMm, Layout = words[1] == "packed" ? VertexLayout.Packed : VertexLayout.Float };
        if (words[2] != "") options.Tissues = words[2].Split(',');
        options.Level = int.Parse(words[3]);
        if (words[4] != "") options.Region = words[4].Split(',').Select(double.Parse).ToArray();
        using (var file = File.OpenRead(words[0]))
        {
            var bytes = new FrameBytes();
            True(bytes.Read(file), "a model");
            var body = new Body(Read(bytes).ModelOpened, bytes);
            True(bytes.Read(file), "a subscription");
            var stream = new MeshStream(options, body);
            stream.Begin(Read(bytes).Subscribed, bytes);
            while (bytes.Read(file))
            {
                stream.Decode(Read(bytes).MeshFrame, bytes);
                var frame = stream.Take();
                foreach (var tissue in frame.Tissues)
                {
                    var shown = options.Layout == VertexLayout.Packed ? MemoryMarshal.AsBytes(tissue.Numbers) : Positions(tissue);
                    string name = body.Tissues[tissue.Tissue].Name;
                    Console.WriteLine(frame.Number + " " + frame.Level.Level + " " + name + " " + Hash(shown));
                    if (options.Layout == VertexLayout.Float) File.WriteAllBytes(Path.Combine(words[5], name + ".normals"), NormalsOf(tissue));
                }
            }
        }
    }

    private static byte[] NormalsOf(TissueVertices tissue)
    {
        var three = new byte[3 * tissue.Count];
        for (int v = 0; v < tissue.Count; ++v) Buffer.BlockCopy(tissue.Bytes, 16 * v + 12, three, 3 * v, 3);
        return three;
    }

    private static Envelope Read(FrameBytes bytes)
    {
        var envelope = new Envelope();
        var reader = new WireReader(bytes.Envelope);
        envelope.Read(ref reader);
        return envelope;
    }

    /// <summary>live ADDRESS OUT ENCODING...: bends an elbow and writes every tissue's positions, LPS mm, into OUT/NAME.f32.</summary>
    private static void Live(string[] words)
    {
        using (var client = Client.Connect(words[0], Options(words, 3)))
        {
            var body = client.Open();
            var encoding = (Encoding)Enum.Parse(typeof(Encoding), words[2]);
            var stream = client.Subscribe(new StreamOptions { Space = Ecorche.Space.LpsMm, Encoding = encoding });
            var pose = client.NewPose().SetAngle("elbow_left", "flexion", 1.2).SetAngle("shoulder_left", "abduction", 0.6).SetAngle("hip_right", "adduction", -0.3);
            ulong sent = client.SendPose(pose);
            var frame = Wait(client, stream, sent);
            foreach (var tissue in frame.Tissues) File.WriteAllBytes(Path.Combine(words[1], body.Tissues[tissue.Tissue].Name + ".f32"), Positions(tissue));
            Console.WriteLine("sequence " + frame.PoseSequence + " encoding " + frame.Encoding + " step " + frame.Step.ToString("R"));
            var probed = client.Probe(new double[] { 0, 0, 1000, 1e6, 0, 0 }, false, true);
            var back = client.Probe(probed.Points.Take(3).ToArray());
            True(probed.Tissues.Length == 2 && probed.Tissues[1] == -1 && double.IsNaN(probed.Points[3]), "a point outside is outside");
            True(Math.Abs(back.Points[2] - 1000) < 0.01, "a probe there and back");
            True(client.Server.Protocol == 1 && client.Models().Count == 1 && client.Models()[0].Name == body.Model, "the server's models");
            True(client.Controls, "who opens a session controls it");
            True(body.FindSegment("LeftForeArm") >= 0 || body.FindSegment("forearm_left") >= 0, "a segment by name");
            try
            {
                pose.SetAngle("nose", "flexion", 1);
                True(false, "a nose bends");
            }
            catch (EcorcheException error)
            {
                True(error.Code == Code.NotFound && error.Message == "nose.flexion: the model has no such angle (ecorche info lists them)", error.Message);
            }
            client.ReleaseControl();
            True(!client.Controls, "control is given up");
            client.ClaimControl();
            True(client.Controls, "and taken");
            client.Unsubscribe(stream);
        }
    }

    /// <summary>refused ADDRESS...: connects and opens.</summary>
    private static void Refused(string[] words)
    {
        using (var client = Client.Connect(words[0], Options(words, 1)))
        {
            client.Open();
            Console.WriteLine("opened " + client.Body.Model);
        }
    }

    /// <summary>resume ADDRESS: bends, waits for a line of input while the line is cut, comes back, bends on.</summary>
    private static void Resume(string[] words)
    {
        using (var client = Client.Connect(words[0]))
        {
            client.Open("", "kept");
            var stream = client.Subscribe(new StreamOptions { Space = Ecorche.Space.LpsMm });
            var pose = client.NewPose();
            ulong sent = client.SendPose(pose.SetAngle("knee_left", "flexion", 0.5));
            Wait(client, stream, sent);
            Console.WriteLine("shown " + sent);
            Lose(client);
            Console.ReadLine();
            try
            {
                client.Resume();
            }
            catch (EcorcheException error) when (error.Code == Code.Unavailable)
            {
                client.Resume();  // where it was sent nobody is
            }
            // A new session shows the scan.
            Wait(client, stream, client.Server.HasResumed ? sent : 0);
            ulong next = client.SendPose(pose.SetAngle("knee_left", "flexion", 0.7));
            True(next > sent && client.Controls, "poses go on");
            Wait(client, stream, next);
            Console.WriteLine("back " + (client.Server.HasResumed ? "resumed" : "anew"));
        }
    }

    /// <summary>replaced ADDRESS: comes back and finds another body, each time that it tries.</summary>
    private static void Replaced(string[] words)
    {
        using (var client = Client.Connect(words[0]))
        {
            client.Open("", "kept");
            client.Subscribe(new StreamOptions());
            Console.WriteLine("shown 0");
            Lose(client);
            Console.ReadLine();
            int refused = 0;
            for (int i = 0; i < 2; ++i)
            {
                try
                {
                    client.Resume();
                }
                catch (EcorcheException error)
                {
                    if (error.Code == Code.FailedPrecondition) ++refused;
                }
            }
            Console.WriteLine("refused " + refused);
        }
    }

    private static void Lose(Client client)
    {
        Console.ReadLine();
        try
        {
            while (client.Poll(5000).Kind != EventKind.None) { }
            True(false, "the line was cut");
        }
        catch (EcorcheException error)
        {
            True(error.Code == Code.Unavailable, error.Message);
            Console.WriteLine("lost " + error.Message);
        }
    }

    /// <summary>leave ADDRESS: poses a session, goes with frames on their way, and comes as somebody else.</summary>
    private static void Leave(string[] words)
    {
        for (int i = 0; i < 3; ++i)
        {
            using (var client = Client.Connect(words[0]))
            {
                client.Open("", "left");
                True(client.Controls, "control is free");
                client.Subscribe(new StreamOptions());
                client.SendPose(client.NewPose().SetAngle("knee_left", "flexion", 0.1 * i));
            }
        }
        Console.WriteLine("controlled by each");
    }

    /// <summary>probes ADDRESS: numbers that are no points, or too many, cost no connection.</summary>
    private static void Probes(string[] words)
    {
        using (var client = Client.Connect(words[0]))
        {
            client.Open();
            int refused = 0;
            foreach (int numbers in new[] { 0, 4, 30003, 600000 })
            {
                try
                {
                    client.Probe(new double[numbers]);
                }
                catch (EcorcheException error) when (error.Code == Code.InvalidArgument)
                {
                    ++refused;
                }
            }
            True(client.Probe(new double[30000]).Points.Length == 30000, "as many as may be");
            Console.WriteLine("refused " + refused);
        }
    }

    /// <summary>volume ADDRESS [compressed]: bends an elbow, and prints what the volume is then.</summary>
    private static void ShowVolume(string[] words)
    {
        using (var client = Client.Connect(words[0]))
        {
            var body = client.Open();
            var volume = client.SubscribeVolume(body.Volumes[0].Name, changedBricks: true, compressed: words.Length > 1);
            var pose = client.NewPose();
            for (int i = 0; i < 6; ++i)
            {
                ulong sent = client.SendPose(pose.SetAngle("elbow_left", "flexion", 0.4 + 0.01 * i));
                while (volume.PoseSequence < sent) True(client.Poll(20000).Kind != EventKind.None, "a volume");
                Console.WriteLine(i + " " + volume.SizeI + " " + volume.SizeJ + " " + volume.SizeK + " " + Hash(volume.Voxels) + (volume.Bricks > 0 ? " by bricks" : ""));
            }
            try
            {
                client.SubscribeVolume(body.Volumes[0].Name, spheres: true);
                True(false, "a model without spheres");
            }
            catch (EcorcheException refused)
            {
                True(refused.Code == Code.FailedPrecondition && refused.Message.Contains("spheres"), refused.Message);
            }
        }
    }
}
