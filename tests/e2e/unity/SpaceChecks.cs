// SPDX-License-Identifier: Apache-2.0
using System;
using Ecorche;

/// <summary>Points, rotations, winding and sides of a body whose left and right differ, in every space.</summary>
internal static class SpaceChecks
{
    public static void Run(string[] words)
    {
        var random = new Random(5);
        for (var space = Space.LpsMm; space <= Space.RasMm; ++space)
        {
            var axes = Axes.Of(space);
            for (int i = 0; i < 100; ++i)
            {
                var p = new Point3(random.NextDouble() - 0.5, random.NextDouble() - 0.5, random.NextDouble() - 0.5);
                var back = axes.Point(p.x, p.y, p.z);
                Near(axes.PointBack(back.x, back.y, back.z), p, "there and back in " + space);
                var q = Unit(random);
                var turned = axes.Rotation(q);
                var moved = Moved(q, p);
                Near(Moved(turned, axes.Point(p.x, p.y, p.z)), axes.Point(moved.x, moved.y, moved.z), "a turn in " + space);
                var again = axes.RotationBack(turned);
                Near(new Point3(again.x, again.y, again.z), new Point3(q.x, q.y, q.z), "a turn back from " + space);
            }
        }
        Body(words[0]);
    }

    /// <summary>A skeleton that stands as the reference and is then turned by known turns drives the body into the pose of those.</summary>
    public static void Drive(string[] words)
    {
        using (var client = Client.Connect(words[0]))
        {
            var body = client.Open();
            var random = new Random(9);
            foreach (Reference reference in Enum.GetValues(typeof(Reference)))
            {
                Pose wanted = new Pose(body), before = PoseDriver.Of(body, reference), found = new Pose(body);
                var driver = new PoseDriver(body, reference);
                Turn[] then = new Turn[body.Segments.Count], now = new Turn[then.Length];
                for (int s = 0; s < then.Length; ++s)
                {
                    bool has = s % 4 != 3;  // the other skeleton lacks some
                    wanted.SetRotation(s, has ? Unit(random) : before.GetRotation(s));
                    int parent = body.Segments[s].Parent;
                    then[s] = parent < 0 ? InBody(body, s, before) : then[parent] * InBody(body, s, before);
                    now[s] = parent < 0 ? InBody(body, s, wanted) : now[parent] * InBody(body, s, wanted);
                    if (has) driver.Set(s, now[s] * then[s].Inverse);
                }
                driver.Apply(found);
                for (int s = 0; s < then.Length; ++s)
                {
                    var off = found.GetRotation(s).Inverse * wanted.GetRotation(s);
                    Check.True(Math.Abs(off.x) + Math.Abs(off.y) + Math.Abs(off.z) < 1e-9, body.Segments[s].Name + " driven from " + reference);
                }
            }
            var arms = PoseDriver.Of(body, Reference.TPose);
            var stream = client.Subscribe(new StreamOptions { Tissues = new[] { "skin" } });
            var frame = Check.Wait(client, stream, client.SendPose(arms));
            float left = 0, right = 0;
            for (int v = 0; v < frame.Tissues[0].Count; ++v)
            {
                left = Math.Min(left, frame.Tissues[0].Floats[4 * v]);
                right = Math.Max(right, frame.Tissues[0].Floats[4 * v]);
            }
            Check.True(left < -0.6f && right > 0.6f, "arms out to " + left + " and " + right);
        }
        Console.WriteLine("three references");
    }

    /// <summary>An arm that hangs on a thorax which follows the spine's four joints is driven to where the server shows it.</summary>
    public static void Follow(string[] words)
    {
        using (var client = Client.Connect(words[0]))
        {
            var body = client.Open();
            var wanted = client.NewPose();
            foreach (string joint in new[] { "lumbosacral", "thoracolumbar" })
                wanted.SetAngle(joint, "flexion", 0.3).SetAngle(joint, "lateral_bending", 0.1);
            wanted.SetAngle("shoulder_left", "flexion", 0.5);
            var stream = client.Subscribe(new StreamOptions { Tissues = new[] { "skin" } });
            Check.Wait(client, stream, client.SendPose(wanted));
            var turned = new Turn[body.Segments.Count];
            var driver = new PoseDriver(body, Reference.AsScanned);
            int levels = 0;
            for (int s = 0; s < turned.Length; ++s)
            {
                int parent = body.Segments[s].Parent;
                string name = body.Segments[s].Name;
                if (name.EndsWith("_spine", StringComparison.Ordinal) || name == "upper_arm_left")
                {
                    turned[s] = turned[parent] * InBody(body, s, wanted);
                    driver.Set(s, turned[s]);
                }
                else
                {
                    bool follows = name.StartsWith("vertebra_", StringComparison.Ordinal);
                    levels += follows ? 1 : 0;
                    turned[s] = parent < 0 ? Turn.None : follows ? turned[parent] * InBody(body, s, Level(body, s, wanted)) : turned[parent];
                }
            }
            var found = new Pose(body);
            driver.Apply(found);
            int arm = body.FindSegment("upper_arm_left");
            var rest = found.GetRotation(arm).Inverse * wanted.GetRotation(arm);
            Check.True(Math.Abs(rest.x) + Math.Abs(rest.y) + Math.Abs(rest.z) < 1e-9, "the arm is off by " + rest.x + ", " + rest.y + ", " + rest.z);
            Console.WriteLine(levels + " levels");
        }
    }

    /// <summary>A level as its couplings have it, of the angles that were asked for.</summary>
    private static Pose Level(Body body, int segment, Pose asked)
    {
        var pose = new Pose(body);
        var joint = body.Segments[segment].Joint;
        foreach (string angle in new[] { "flexion", "lateral_bending" })
        {
            double moved = 0;
            for (int i = 0; i < joint.Coupled.Count; ++i)
            {
                var by = joint.Coupled[i];
                var leader = body.Segments[(int)by.Joint].Joint;
                if (joint.Sequence[(int)by.DrivenAngle].Name != angle || leader.Name == "cervicothoracic" || leader.Name == "atlantooccipital") continue;
                moved = by.Ratio * ((angle == "flexion" ? 0.3 : 0.1) - leader.Sequence[(int)by.Angle].Rest);
            }
            pose.SetAngle(joint.Name, angle, moved);
        }
        return pose;
    }

    /// <summary>A q A' by matrices.</summary>
    private static Turn InBody(Body body, int segment, Pose pose)
    {
        var joint = body.Segments[segment].Joint;
        var q = pose.GetRotation(segment);
        Ecorche.Wire.Vector3 x = joint.AxisX, y = joint.AxisY, z = joint.AxisZ;
        return new Turn(x.X * q.x + y.X * q.y + z.X * q.z, x.Y * q.x + y.Y * q.y + z.Y * q.z, x.Z * q.x + y.Z * q.y + z.Z * q.z, q.w);
    }

    /// <summary>
    /// The posed skin encloses a volume in every space, in left-handed numbers a negative one where triangles are not wound anew as in Unity, and the bone of
    /// the left hand is where its character's left is.
    /// </summary>
    private static void Body(string address)
    {
        using (var client = Client.Connect(address))
        {
            var body = client.Open();
            int hand = body.FindSegment("hand_left"), bone = -1;
            for (int t = 0; t < body.Tissues.Count; ++t)
                if (body.Tissues[t].Segment == hand) bone = t;
            ulong sent = client.SendPose(client.NewPose().SetAngle("shoulder_left", "abduction", 1.4));
            double whole = 0;
            for (var space = Space.LpsMm; space <= Space.RasMm; ++space)
            {
                var stream = client.Subscribe(new StreamOptions { Space = space, Tissues = new[] { "skin", body.Tissues[bone].Name } });
                var frame = Check.Wait(client, stream, sent);
                int sense = space == Space.Unreal ? -1 : 1;
                double volume = sense * Volume(frame.Tissues[0], frame.Level.Parts[0].Triangles) / Math.Pow(Axes.Of(space).Scale, 3);
                if (space == Space.LpsMm) whole = volume;
                Check.True(volume > 1e6 && Math.Abs(volume / whole - 1) < 1e-3, "the skin's volume in " + space + " is " + volume);
                Outward(frame.Tissues[0], frame.Level.Parts[0].Triangles, sense, space);
                var (x, y, z) = Middle(frame.Tissues[1]);
                double left = new[] { x, -x, -y, x, y, -x }[(int)space] / Axes.Of(space).Scale;
                double up = new[] { z, y, z, y, z, z }[(int)space] / Axes.Of(space).Scale;
                Check.True(left > 300 && up > 300, "the left hand in " + space + " is at " + left + ", " + up);
                client.Unsubscribe(stream);
            }
        }
        Console.WriteLine("six spaces");
    }

    private static (double x, double y, double z) Middle(TissueVertices tissue)
    {
        double x = 0, y = 0, z = 0;
        for (int v = 0; v < tissue.Count; ++v)
        {
            x += tissue.Floats[4 * v] / tissue.Count;
            y += tissue.Floats[4 * v + 1] / tissue.Count;
            z += tissue.Floats[4 * v + 2] / tissue.Count;
        }
        return (x, y, z);
    }

    private static double Volume(TissueVertices tissue, int[] triangles)
    {
        var f = tissue.Floats;
        double sum = 0;
        for (int i = 0; i < triangles.Length; i += 3)
        {
            int a = 4 * triangles[i], b = 4 * triangles[i + 1], c = 4 * triangles[i + 2];
            sum += f[a] * ((double)f[b + 1] * f[c + 2] - (double)f[b + 2] * f[c + 1]) - f[a + 1] * ((double)f[b] * f[c + 2] - (double)f[b + 2] * f[c])
                + f[a + 2] * ((double)f[b] * f[c + 1] - (double)f[b + 1] * f[c]);
        }
        return sum / 6;
    }

    /// <summary>Normals point the way of their triangles.</summary>
    private static void Outward(TissueVertices tissue, int[] triangles, int sense, Space space)
    {
        var f = tissue.Floats;
        int agree = 0;
        for (int i = 0; i < triangles.Length; i += 3)
        {
            int a = 4 * triangles[i], b = 4 * triangles[i + 1], c = 4 * triangles[i + 2];
            double ux = f[b] - f[a], uy = f[b + 1] - f[a + 1], uz = f[b + 2] - f[a + 2], vx = f[c] - f[a], vy = f[c + 1] - f[a + 1], vz = f[c + 2] - f[a + 2];
            int bits = BitConverter.ToInt32(tissue.Bytes, 4 * (a + 3));
            double along = (uy * vz - uz * vy) * (sbyte)bits + (uz * vx - ux * vz) * (sbyte)(bits >> 8) + (ux * vy - uy * vx) * (sbyte)(bits >> 16);
            if (sense * along > 0) ++agree;
        }
        Check.True(agree > 0.95 * triangles.Length / 3, "normals in " + space + ": " + agree + " of " + triangles.Length / 3 + " triangles");
    }

    public static Point3 Moved(Turn q, Point3 p)
    {
        double tx = 2 * (q.y * p.z - q.z * p.y), ty = 2 * (q.z * p.x - q.x * p.z), tz = 2 * (q.x * p.y - q.y * p.x);
        return new Point3(p.x + q.w * tx + q.y * tz - q.z * ty, p.y + q.w * ty + q.z * tx - q.x * tz, p.z + q.w * tz + q.x * ty - q.y * tx);
    }

    public static Turn Unit(Random random)
    {
        double x = random.NextDouble() - 0.5, y = random.NextDouble() - 0.5, z = random.NextDouble() - 0.5, w = random.NextDouble();
        double length = Math.Sqrt(x * x + y * y + z * z + w * w);
        return new Turn(x / length, y / length, z / length, w / length);
    }

    private static void Near(Point3 a, Point3 b, string what)
    {
        Check.True(Math.Abs(a.x - b.x) + Math.Abs(a.y - b.y) + Math.Abs(a.z - b.z) < 1e-9, what);
    }
}
