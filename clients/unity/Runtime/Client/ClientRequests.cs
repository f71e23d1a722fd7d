// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using Ecorche.Wire;

namespace Ecorche
{
    /// <summary>Points on the other side of a pose.</summary>
    public sealed class Probed
    {
        /// <summary>Three a point, LPS mm; NaN outside the body.</summary>
        public double[] Points { get; internal set; }
        /// <summary>Row of Body.Tissues that holds the point in the scan; -1: none. Empty where not asked for.</summary>
        public int[] Tissues { get; internal set; } = System.Array.Empty<int>();
        /// <summary>Of which pose.</summary>
        public ulong PoseSequence { get; internal set; }
    }

    /// <summary>Motion that a server can play.</summary>
    public struct Clip
    {
        public string Name;
        public double Seconds;
    }

    public sealed partial class Client
    {
        /// <summary>The models that the server has.</summary>
        public Repeated<ModelSummary> Models()
        {
            Begin(_out).HasListModels = true;
            return Keep(Call(default), envelope => envelope.HasModelList).ModelList.Models;
        }

        /// <summary>Opens a model ("": the first) in a session that others may join by its name ("": one of its own). Once for a connection.</summary>
        /// <exception cref="EcorcheException">NotFound: another model. FailedPrecondition: the session has another.</exception>
        public Body Open(string model = "", string session = "")
        {
            if (Body != null) throw new EcorcheException(Code.FailedPrecondition, "has a model already (connect once more for another)");
            return Body = ReadBody(model, session);
        }

        private Body ReadBody(string model, string session)
        {
            Begin(_out).HasOpenModel = true;
            _out.OpenModel.Clear();
            _out.OpenModel.Model = model;
            _out.OpenModel.Session = session;
            var came = Call(default);
            using (new Returned(_line, came))
            {
                var kept = new Envelope();
                var reader = new WireReader(came.Envelope);
                kept.Read(ref reader);
                if (!kept.HasModelOpened) throw EcorcheException.Damaged("it answers OpenModel with something else");
                var body = new Body(kept.ModelOpened, came);
                _sequence = Math.Max(_sequence, kept.ModelOpened.LastSequence);
                Controls = kept.ModelOpened.Role == Role.Controller;
                return body;
            }
        }

        /// <summary>A pose to edit and send: what the session showed when it was opened.</summary>
        public Pose NewPose()
        {
            var pose = new Pose(Opened());
            if (Body.Opened.HasPose) pose.Take(Body.Opened.Pose);
            return pose;
        }

        /// <summary>Frames come from now on, the present pose first.</summary>
        public MeshStream Subscribe(StreamOptions options = null)
        {
            var stream = new MeshStream(options ?? new StreamOptions(), Opened());
            Subscribe(stream);
            _streams.Add(stream);
            return stream;
        }

        private void Subscribe(MeshStream stream)
        {
            var options = stream.Options;
            var subscribe = Begin(_out).Subscribe;
            _out.HasSubscribe = true;
            subscribe.Clear();
            subscribe.MaxRate = options.MaxRate;
            subscribe.HasMesh = true;
            var mesh = subscribe.Mesh;
            mesh.Clear();
            foreach (string name in options.Tissues) mesh.Tissues.Append(name);
            mesh.Encoding = options.Motions ? Encoding.F32 : options.Encoding;
            mesh.Normals = options.Normals && !options.Motions;
            mesh.Quality = options.Quality;
            mesh.Level = (uint)options.Level;
            mesh.Adaptive = options.Adaptive;
            mesh.Motions = options.Motions;
            mesh.HasRegion = SetBox(mesh.Region, options.Region);
            var came = Call(default);
            using (new Returned(_line, came))
            {
                if (!_in.HasSubscribed) throw EcorcheException.Damaged("it answers Subscribe with something else");
                stream.Begin(_in.Subscribed, came);
            }
        }

        private static bool SetBox(Box box, double[] region)
        {
            if (region == null) return false;
            if (region.Length != 6) throw new EcorcheException(Code.InvalidArgument, "region: has " + region.Length + " numbers (give min x, y, z, max x, y, z)");
            box.HasMin = box.HasMax = true;
            (box.Min.X, box.Min.Y, box.Min.Z) = (region[0], region[1], region[2]);
            (box.Max.X, box.Max.Y, box.Max.Z) = (region[3], region[4], region[5]);
            return true;
        }

        private static void Set(Vector3 to, Point3 point) => (to.X, to.Y, to.Z) = (point.x, point.y, point.z);

        public void Unsubscribe(MeshStream stream)
        {
            if (!_streams.Remove(stream) || _streams.Exists(one => one.Subscription == stream.Subscription)) return;
            Unsubscribe(stream.Subscription);
        }

        private void Unsubscribe(uint subscription)
        {
            Begin(_out).HasUnsubscribe = true;
            _out.Unsubscribe.Subscription = subscription;
            _line.Release(Call(default));
        }

        /// <summary>Frames of a posed volume, whole or a `region` of the posed space (LPS mm). `changedBricks`: less on the way, all voxels here;
        /// `compressed`: by zstd, for lines that are slower than its decoder; `spheres`: posed by the balls that the model holds, not by tets;
        /// `slices`: so many planes instead of the volume, at most 16, without `region` and `changedBricks`.</summary>
        public VolumeStream SubscribeVolume(string name, bool nearest = false, bool changedBricks = false, double[] region = null, double maxRate = 0,
            bool compressed = false, bool spheres = false, IReadOnlyList<SlicePlane> slices = null)
        {
            var stream = new VolumeStream(Opened(), name, nearest, changedBricks, region, maxRate, compressed, spheres, slices);
            Subscribe(stream);
            _volumes.Add(stream);
            return stream;
        }

        private void Subscribe(VolumeStream stream)
        {
            var subscribe = Begin(_out).Subscribe;
            _out.HasSubscribe = true;
            subscribe.Clear();
            subscribe.MaxRate = stream.MaxRate;
            subscribe.HasVolume = true;
            subscribe.Volume.Clear();
            subscribe.Volume.Volume = stream.Name;
            subscribe.Volume.Nearest = stream.Nearest;
            subscribe.Volume.ChangedBricks = stream.ChangedBricks;
            subscribe.Volume.Compressed = stream.Compressed;
            subscribe.Volume.Deformer = stream.Spheres ? Deformer.Spheres : Deformer.Tets;
            subscribe.Volume.HasRegion = SetBox(subscribe.Volume.Region, stream.Region);
            foreach (var plane in stream.Slices)
            {
                var slice = subscribe.Volume.Slices.Add();
                slice.HasOrigin = slice.HasU = slice.HasV = true;
                Set(slice.Origin, plane.Origin);
                Set(slice.U, plane.U);
                Set(slice.V, plane.V);
                (slice.SizeU, slice.SizeV) = ((uint)plane.SizeU, (uint)plane.SizeV);
            }
            var came = Call(default);
            using (new Returned(_line, came)) stream.Begin(_in.Subscribed.Subscription);
        }

        public void Unsubscribe(VolumeStream stream)
        {
            if (!_volumes.Remove(stream) || _volumes.Exists(one => one.Subscription == stream.Subscription)) return;
            Unsubscribe(stream.Subscription);
        }

        /// <summary>Takes control where it is free.</summary>
        /// <exception cref="EcorcheException">PermissionDenied: another has it.</exception>
        public void ClaimControl()
        {
            Begin(_out).HasClaimControl = true;
            var came = Call(default);
            using (new Returned(_line, came))
            {
                _sequence = Math.Max(_sequence, _in.ControlGranted.LastSequence);
                Controls = true;
            }
        }

        public void ReleaseControl()
        {
            Begin(_out).HasReleaseControl = true;
            _line.Release(Call(default));
            Controls = false;
        }

        /// <summary>Points (three each, LPS mm) of the posed body back to the scan, or the other way, of the pose that was shown last; 10000 at most.</summary>
        /// <exception cref="EcorcheException">InvalidArgument: not three each, none, or too many.</exception>
        public Probed Probe(double[] points, bool toRest = true, bool tissues = false)
        {
            const int most = 10000;
            Opened();
            if (points == null || points.Length % 3 != 0 || points.Length < 3 || points.Length > 3 * most)
                throw new EcorcheException(Code.InvalidArgument, "points: are not three numbers each of 1 to " + most + " points");
            var probe = Begin(_out).ProbePoints;
            _out.HasProbePoints = true;
            probe.Clear();
            probe.Direction = toRest ? ProbePointsDirection.PosedToRest : ProbePointsDirection.RestToPosed;
            probe.HasPoints = true;
            probe.Points.Clear();
            (probe.Points.Type, probe.Points.Components, probe.Points.Count) = (ScalarType.F64, 3, (ulong)points.Length / 3);
            probe.Tissue = tissues;
            var came = Call(MemoryMarshal.AsBytes<double>(points));
            using (new Returned(_line, came))
            {
                var found = new Probed { PoseSequence = _in.Probed.PoseSequence, Points = came.Rows<double>(_in.Probed.Points, ScalarType.F64, 3).ToArray() };
                if (_in.Probed.HasTissue) found.Tissues = came.Rows<int>(_in.Probed.Tissue, ScalarType.I32, 1).ToArray();
                return found;
            }
        }

        /// <summary>Motion that the server holds.</summary>
        public List<Clip> Clips()
        {
            Opened();
            Begin(_out).HasListClips = true;
            var clips = new List<Clip>();
            var came = Call(default);
            using (new Returned(_line, came))
                for (int i = 0; i < _in.ClipList.Clips.Count; ++i) clips.Add(new Clip { Name = _in.ClipList.Clips[i].Name, Seconds = _in.ClipList.Clips[i].Seconds });
            return clips;
        }

        /// <summary>The server poses by itself, until the clip ends or a pose is sent; "" stops it. `speed`: 0.01 to 100.</summary>
        public void Play(string clip, double speed = 1, bool loop = false)
        {
            Opened();
            Begin(_out).HasPlayClip = true;
            _out.PlayClip.Clear();
            (_out.PlayClip.Name, _out.PlayClip.Speed, _out.PlayClip.Loop) = (clip, speed, loop);
            _line.Release(Call(default));
        }

        /// <summary>
        /// After the connection was lost: connects again and has the session, its control and its frames as before, where the server kept the place
        /// (a minute), else as anybody who opens the session by its name. Frames that were read stay good.
        /// </summary>
        /// <exception cref="EcorcheException">Unavailable: nobody answers yet, call again after a while; who was sent to another server tries the two in
        /// turn. FailedPrecondition: the model is another one by now, connect anew.</exception>
        public void Resume()
        {
            Greet(Server.ResumeToken);
            if (Body == null) return;
            if (Server.HasResumed) TakePlace(Server.Resumed);
            else OpenAgain();
        }

        private void TakePlace(Resumed place)
        {
            Controls = place.Role == Role.Controller;
            _sequence = Math.Max(_sequence, place.LastSequence);
            foreach (var stream in _streams)
            {
                stream.ForgetKeyframes();
                if (Find(place, stream.Subscription, out uint now)) stream.Subscription = now;
                else Subscribe(stream);
            }
            foreach (var volume in _volumes)
            {
                if (Find(place, volume.Subscription, out uint now)) volume.Begin(now);
                else Subscribe(volume);
            }
        }

        private static bool Find(Resumed place, uint was, out uint now)
        {
            for (int i = 0; i < place.Subscriptions.Count; ++i)
            {
                now = place.Subscriptions[i].Is;
                if (place.Subscriptions[i].Was == was) return true;
            }
            now = 0;
            return false;
        }

        private void OpenAgain()
        {
            var now = ReadBody(Body.Model, Body.Session);
            if (now.TopologyDigest != Body.TopologyDigest || now.RigDigest != Body.RigDigest)
            {
                // That place is the other body's: who tries again is not to have it as this one's.
                Dispose();
                Server.ResumeToken = System.Array.Empty<byte>();
                throw new EcorcheException(Code.FailedPrecondition, "the server's model is another one by now (connect anew)");
            }
            foreach (var stream in _streams) Subscribe(stream);
            foreach (var volume in _volumes) Subscribe(volume);
        }
    }
}
