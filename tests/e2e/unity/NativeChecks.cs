// SPDX-License-Identifier: Apache-2.0
using System;
using System.IO;
using Ecorche;
using Ecorche.Native;

/// <summary>native MODEL ADDRESS: the same body by libecorche and from a server.</summary>
internal static class NativeChecks
{
    public static void Run(string[] words)
    {
        for (var space = Space.LpsMm; space <= Space.RasMm; ++space)
        {
            var matrix = new double[9];
            bool mirrors = NativeMethods.ecorche_space_matrix(space, matrix) == 1;
            var axes = Axes.Of(space);
            var point = axes.Point(1, 2, 3);
            double[] found = { point.x, point.y, point.z };
            for (int r = 0; r < 3; ++r)
                Check.True(Math.Abs(found[r] - matrix[3 * r] - 2 * matrix[3 * r + 1] - 3 * matrix[3 * r + 2]) < 1e-12, "libecorche has " + space + " otherwise");
            Check.True(mirrors == axes.Mirrors, space + " mirrors");
        }
        using (var model = new NativeModel(words[0]))
        using (var pose = new NativePose(model).SetAngle("elbow_left", "flexion", 1.2).SetAngle("hip_right", "adduction", -0.3))
        using (var posed = new NativeBody(model).Update(pose))
        using (var client = Client.Connect(words[1]))
        {
            var body = client.Open();
            var stream = client.Subscribe(new StreamOptions { Encoding = Ecorche.Wire.Encoding.F32 });
            var frame = Check.Wait(client, stream, client.SendPose(client.NewPose().SetAngle("elbow_left", "flexion", 1.2).SetAngle("hip_right", "adduction", -0.3)));
            Check.True(model.TissueCount == body.Tissues.Count && model.SegmentCount == body.Segments.Count, "the same model");
            double worst = 0;
            for (int t = 0; t < model.TissueCount; ++t)
            {
                var tissue = model.Tissue(t);
                var vertices = new float[6 * tissue.VertexCount];
                posed.Copy(t, Space.Unity, vertices);
                Check.True(tissue.Name == body.Tissues[t].Name && model.FindTissue(tissue.Name) == t, "tissues alike");
                Check.True(tissue.Triangles.AsSpan().SequenceEqual(body.Triangles(t)) && tissue.Segment == body.Tissues[t].Segment, "triangles alike");
                for (int v = 0; v < tissue.VertexCount; ++v)
                    for (int c = 0; c < 3; ++c) worst = Math.Max(worst, Math.Abs(vertices[6 * v + c] - frame.Tissues[t].Floats[4 * v + c]));
            }
            Check.True(worst < 1e-6, "in process and served differ by " + worst + " m");
            var tissues = new int[1];
            var there = posed.Probe(new float[] { 0, 0, 1000 }, false, tissues);
            var back = posed.Probe(there);
            Check.True(Math.Abs(back[2] - 1000) < 0.01 && tissues[0] >= 0, "a probe there and back");
            Check.True(posed.Measure().MinDetF <= 1.1, "a measure");
        }
        try
        {
            new NativeModel(Path.Combine(Path.GetTempPath(), "nowhere.hdf"));
            Check.True(false, "nowhere opens");
        }
        catch (EcorcheException error)
        {
            Check.True(error.Code == Code.NotFound && error.Message.Contains("nowhere.hdf"), error.Message);
        }
        Console.WriteLine("alike");
    }
}
