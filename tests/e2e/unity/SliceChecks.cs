// SPDX-License-Identifier: Apache-2.0
using System;
using System.Linq;
using Ecorche;

internal static class SliceChecks
{
    /// <summary>slices ADDRESS [compressed]: planes along two axes of the lattice, held against the volume in the same pose.</summary>
    public static void Run(string[] words)
    {
        using (var client = Client.Connect(words[0]))
        {
            var body = client.Open();
            string name = body.Volumes[0].Name;
            var volume = client.SubscribeVolume(name);
            ulong sent = client.SendPose(client.NewPose().SetAngle("elbow_left", "flexion", 0.5));
            while (volume.PoseSequence < sent) Check.True(client.Poll(20000).Kind != EventKind.None, "a volume");
            int i = volume.SizeI / 2, k = volume.SizeK / 3, wide = volume.Components * FrameBytes.BytesOf(volume.Type);
            Func<int, int, int, Point3> at = (a, b, c) => Add(volume.Origin, Axis(volume, 0, a), Axis(volume, 1, b), Axis(volume, 2, c));
            var planes = new[]
            {
                new SlicePlane(at(0, 0, k), Axis(volume, 0, 1), Axis(volume, 1, 1), volume.SizeI, volume.SizeJ),
                new SlicePlane(at(i, 0, 0), Axis(volume, 1, 1), Axis(volume, 2, 1), volume.SizeJ, volume.SizeK),
            };
            var slices = client.SubscribeVolume(name, compressed: words.Length > 1, slices: planes);
            Check.True(slices.SliceVoxels(0).IsEmpty && slices.Slices.Count == 2, "nothing has come yet");
            while (slices.PoseSequence < sent) Check.True(client.Poll(20000).Kind != EventKind.None, "slices");
            Check.True(slices.SizeI == 0 && slices.Voxels.Length == slices.SliceVoxels(0).Length + slices.SliceVoxels(1).Length, "sizes");
            int other = 0, something = 0;
            Action<int, int, int> count = (slice, pixel, voxel) =>
            {
                var one = slices.SliceVoxels(slice).Slice(pixel * wide, wide);
                if (!one.SequenceEqual(volume.Voxels.Slice(voxel * wide, wide))) ++other;
                if (!one.SequenceEqual(slices.SliceVoxels(slice).Slice(0, wide))) ++something;
            };
            for (int v = 0; v < volume.SizeJ; ++v)
            {
                for (int u = 0; u < volume.SizeI; ++u) count(0, v * volume.SizeI + u, (k * volume.SizeJ + v) * volume.SizeI + u);
                for (int w = 0; w < volume.SizeK; ++w) count(1, w * volume.SizeJ + v, (w * volume.SizeJ + v) * volume.SizeI + i);
            }
            Console.WriteLine(other + " differ, " + (something > 1000 ? "many" : "few") + " are not background");
            Refused(() => slices.SliceVoxels(2));
            Refused(() => new SlicePlane(planes[0].Origin, planes[0].U, planes[0].V, 0, 5));
            Refused(() => client.SubscribeVolume(name, slices: planes, changedBricks: true));
            Refused(() => client.SubscribeVolume(name, slices: new SlicePlane[17].Select(_ => planes[0]).ToArray()));
        }
    }

    private static void Refused(Action what)
    {
        try
        {
            what();
        }
        catch (Exception error) when (error is ArgumentOutOfRangeException || error is EcorcheException refused && refused.Code == Code.InvalidArgument)
        {
            Console.WriteLine("refused: " + error.Message.Split('\n')[0]);
        }
    }

    private static Point3 Axis(VolumeStream volume, int axis, int steps)
    {
        double mm = steps * (axis == 0 ? volume.Spacing.x : axis == 1 ? volume.Spacing.y : volume.Spacing.z);
        return new Point3(mm * volume.Direction[axis], mm * volume.Direction[3 + axis], mm * volume.Direction[6 + axis]);
    }

    private static Point3 Add(params Point3[] points) => new Point3(points.Sum(p => p.x), points.Sum(p => p.y), points.Sum(p => p.z));
}
