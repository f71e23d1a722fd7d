// SPDX-License-Identifier: Apache-2.0
using System;
using Ecorche;
using Ecorche.Wire;

/// <summary>skinning.hlsl once more, slow, on the tables that the package gives to it: held against the server's vertices.</summary>
internal static class SkinChecks
{
    public static void Run(string[] words)
    {
        using (var client = Client.Connect(words[0]))
        {
            client.Open();
            var motions = client.Subscribe(new StreamOptions { Motions = true });
            var exact = client.Subscribe(new StreamOptions { Encoding = Encoding.F32, Space = Ecorche.Space.LpsMm });
            var pose = client.NewPose().SetAngle("elbow_left", "flexion", 1.1).SetAngle("hip_right", "flexion", 0.8).SetAngle("knee_right", "flexion", 0.7);
            foreach (var method in new[] { Skinning.Lbs, Skinning.Cor })
            {
                pose.Skinning = method;
                ulong sent = client.SendPose(pose);
                BodyFrame moved = null, whole = null;
                while (moved?.PoseSequence != sent || whole?.PoseSequence != sent)
                {
                    Check.True(client.Poll(20000).Kind != EventKind.None, "frames of " + method);
                    moved = motions.Take() ?? moved;
                    whole = exact.Take() ?? whole;
                }
                Check.True(moved.Skinning == method, "the frame's method");
                double worst = Compare(motions.Skinning, moved, whole, method);
                Check.True(worst < motions.Skinning.LargestError + 0.1, method + " is " + worst + " mm off, told " + motions.Skinning.LargestError);
                Console.WriteLine(method + " within " + worst.ToString("F3") + " mm, told " + motions.Skinning.LargestError.ToString("F3"));
            }
        }
    }

    private static double Compare(SkinningTable table, BodyFrame moved, BodyFrame whole, Skinning method)
    {
        var rows = new float[8 * (moved.Motions.Length / 7)];
        var box = table.Place(moved.Motions, rows);
        double worst = 0;
        for (int t = 0; t < table.Tissues.Length; ++t)
        {
            var to = whole.Find(table.Tissues[t].Tissue);
            Check.True(to != null && to.Count == table.Tissues[t].Count, "a tissue's vertices");
            for (int v = 0; v < to.Count; ++v)
            {
                var p = Vertex(table, rows, table.Tissues[t].First + v, method);
                double dx = p.x + box.Low.x - to.Floats[4 * v], dy = p.y + box.Low.y - to.Floats[4 * v + 1], dz = p.z + box.Low.z - to.Floats[4 * v + 2];
                Check.True(p.x >= 0 && p.y >= 0 && p.z >= 0 && Math.Max(p.x, Math.Max(p.y, p.z)) <= 65535 * box.Step, "a vertex lies outside of its box");
                worst = Math.Max(worst, Math.Sqrt(dx * dx + dy * dy + dz * dz));
            }
        }
        return worst;
    }

    private static Point3 Vertex(SkinningTable table, float[] rows, int vertex, Skinning method)
    {
        uint hung = table.HungRows[vertex];
        if (hung == 0) return Point(table, rows, vertex, method);
        double x = 0, y = 0, z = 0;
        for (int c = 0; c < 4; ++c)
        {
            int at = 8 * ((int)hung - 1) + c;
            double share = BitConverter.ToSingle(BitConverter.GetBytes(table.Hung[at + 4]), 0);
            var p = Point(table, rows, (int)table.Hung[at], method);
            (x, y, z) = (x + share * p.x, y + share * p.y, z + share * p.z);
        }
        return new Point3(x, y, z);
    }

    private static Point3 Point(SkinningTable table, float[] rows, int point, Skinning method)
    {
        Func<uint, uint, uint, Point3> rest = (a, b, c) => new Point3((a - 32768.0) * table.Step, (b - 32768.0) * table.Step, (c - 32768.0) * table.Step);
        uint xy = table.Points[4 * point], zn = table.Points[4 * point + 1], cxy = table.Points[4 * point + 2], cz = table.Points[4 * point + 3];
        var own = rest(xy & 65535, xy >> 16, zn & 65535);
        var centre = method == Skinning.Cor ? rest(cxy & 65535, cxy >> 16, cz & 65535) : own;
        double x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 0;
        for (int k = 0; k < table.Influences; ++k)
        {
            uint influence = table.Weights[table.Influences * point + k];
            double w = (influence >> 16) / 65535.0;
            int at = 8 * (int)(influence & 65535);
            var q = new Turn(rows[at], rows[at + 1], rows[at + 2], rows[at + 3]);
            var moved = SpaceChecks.Moved(q, centre);
            (x, y, z) = (x + w * (moved.x + rows[at + 4]), y + w * (moved.y + rows[at + 5]), z + w * (moved.z + rows[at + 6]));
            (qx, qy, qz, qw) = (qx + w * q.x, qy + w * q.y, qz + w * q.z, qw + w * q.w);
        }
        if (method == Skinning.Lbs) return new Point3(x, y, z);
        double size = Math.Sqrt(qx * qx + qy * qy + qz * qz + qw * qw);
        var rest2 = SpaceChecks.Moved(new Turn(qx / size, qy / size, qz / size, qw / size), new Point3(own.x - centre.x, own.y - centre.y, own.z - centre.z));
        return new Point3(x + rest2.x, y + rest2.y, z + rest2.z);
    }
}
