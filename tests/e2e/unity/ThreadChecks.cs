// SPDX-License-Identifier: Apache-2.0
using System;
using System.Threading;
using Ecorche;

/// <summary>The thread that Unity's components use: poses and frames, a line that is cut and mended, a model that is replaced.</summary>
internal static class ThreadChecks
{
    public static void Run(string[] words)
    {
        using (var thread = new ClientThread(words[0], null, new StreamOptions { Tissues = new[] { "skin" } }, "", "kept"))
        {
            Until(() => thread.State == LinkState.Open, thread);
            var pose = new Pose(thread.Body);
            float before = Leftmost(Next(thread)), bent = 0;
            thread.SetPose(pose.SetAngle("shoulder_left", "abduction", 1.4));
            Until(() => Math.Abs((bent = Leftmost(Next(thread))) - before) > 0.05f, thread);
            var probed = thread.Ask(client => client.Probe(new double[] { 0, 0, 1000 }, false));
            Check.True(probed.Wait(20000) && probed.Result.Points.Length == 3, "a probe between frames");
            Console.WriteLine("shown");
            Console.ReadLine();
            Until(() => thread.State == LinkState.Lost, thread);
            Check.True(thread.Error.Code == Code.Unavailable, "" + thread.Error);
            Console.WriteLine("lost");
            Console.ReadLine();
            Until(() => thread.State == LinkState.Open, thread);
            thread.SetPose(pose.SetAngle("shoulder_left", "abduction", 0.2));
            Until(() => Math.Abs(Leftmost(Next(thread)) - bent) > 0.05f, thread);
            Console.WriteLine("back " + thread.Generation);
            Console.ReadLine();
            Until(() => thread.Generation == 2 && thread.State == LinkState.Open, thread);
            Next(thread);
            Console.WriteLine("replaced " + thread.Body.Model);
        }
    }

    private static BodyFrame Next(ClientThread thread)
    {
        BodyFrame frame = null;
        Until(() => (frame = thread.Stream.Take()) != null, thread);
        return frame;
    }

    private static float Leftmost(BodyFrame frame)
    {
        float least = float.PositiveInfinity;
        for (int v = 0; v < frame.Tissues[0].Count; ++v) least = Math.Min(least, frame.Tissues[0].Floats[4 * v]);
        return least;
    }

    private static void Until(Func<bool> holds, ClientThread thread)
    {
        for (var until = DateTime.UtcNow.AddSeconds(30); !holds(); Thread.Sleep(2))
            if (DateTime.UtcNow > until) throw new Exception("nothing came: " + thread.State + " " + thread.Error);
    }
}
