// SPDX-License-Identifier: Apache-2.0
// Five steps without Unity: mcs -unsafe -out:five.exe FiveSteps.cs with the sources of Runtime/Client, and `mono five.exe 127.0.0.1:7070`.
using System;
using Ecorche;

internal static class FiveSteps
{
    private static void Main(string[] words)
    {
        using (var client = Client.Connect(words.Length > 0 ? words[0] : "127.0.0.1:7070"))  // 1. connect
        {
            var body = client.Open();                                                         // 2. open: the server's first model
            var stream = client.Subscribe(new StreamOptions { Tissues = new[] { "skin" } });
            ulong sent = client.SendPose(client.NewPose().SetAngle("elbow_left", "flexion", 1.2));  // 3. pose: radians
            BodyFrame frame = null;
            while (frame == null || frame.PoseSequence < sent)
            {
                if (client.Poll(5000).Kind == EventKind.None) throw new TimeoutException();
                frame = stream.Take() ?? frame;
            }
            var skin = frame.Tissues[0];                                                      // 4. draw: 16 bytes a vertex, in Unity's space
            Console.WriteLine(skin.Count + " vertices, the first at y = " + skin.Floats[1].ToString("F3") + " m, " + (frame.Quality.Passes ? "pass" : "warn"));
            var found = client.Probe(new double[] { 0, 0, 1000 }, true, true);                // 5. probe: LPS mm
            Console.WriteLine(found.Tissues[0] < 0 ? "nothing is there" : "there is " + body.Tissues[found.Tissues[0]].Name);
        }
    }
}
