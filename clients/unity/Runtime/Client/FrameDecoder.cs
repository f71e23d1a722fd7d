// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using Ecorche.Wire;

namespace Ecorche
{
    /// <summary>Frames of one subscription into vertices. Keeps the keyframe of every level. Trusts nothing; allocates where a level comes first.</summary>
    internal sealed unsafe class FrameDecoder
    {
        private readonly Axes _axes;
        private readonly VertexLayout _layout;
        private readonly ulong _digest;
        private readonly bool _motions;
        private readonly Body _body;
        private readonly uint[] _table;
        private readonly List<MeshLevel> _levels = new List<MeshLevel>();
        private readonly ulong[] _room = new ulong[Deltas.Scratch];
        /// <summary>A block's numbers by axis.</summary>
        private readonly ulong[] _planes = new ulong[3 * Deltas.Block / 4];

        public FrameDecoder(StreamOptions options, Body body)
        {
            _axes = Axes.Of(options.Space);
            _layout = options.Layout;
            _motions = options.Motions;
            _body = body;
            _digest = body.TopologyDigest;
            _table = Vertices.Normals(options.Space);
            var names = new Repeated<string>();
            foreach (string name in options.Tissues) names.Append(name);
            if (options.Region == null && options.Level == 0) _levels.Add(MeshLevel.Whole(body, names, _axes));
        }

        public IReadOnlyList<MeshLevel> Levels => _levels;

        public void Begin(Subscribed told, FrameBytes from)
        {
            for (int i = 0; i < told.Levels.Count; ++i)
            {
                var level = MeshLevel.Read(told.Levels[i], from, _body, _axes);
                int at = _levels.FindIndex(one => one.Level == level.Level);
                if (at < 0) _levels.Add(level);
                else _levels[at] = level;
            }
            ForgetKeyframes();
        }

        public void ForgetKeyframes()
        {
            foreach (var level in _levels) level.HasKeyframe = false;
        }

        public void Decode(MeshFrame told, FrameBytes from, BodyFrame to)
        {
            if (told.TopologyDigest != _digest) throw EcorcheException.Damaged("a frame of another model");
            to.PoseSequence = told.PoseSequence;
            to.Number = told.Frame;
            to.Encoding = told.Encoding;
            to.Skinning = told.Skinning;
            to.SetClamped(told.Clamped);
            to.Low = new Point3(told.Box.LowX, told.Box.LowY, told.Box.LowZ);
            to.Step = told.Box.Step;
            if (_motions)
            {
                ReadMotions(told, from, to);
                return;
            }
            to.Level = Find((int)told.Level);
            bool key = told.Encoding == Encoding.U16Delta && told.Keyframe == told.Frame;
            if (told.Encoding == Encoding.U16Delta && !key && (!to.Level.HasKeyframe || to.Level.Keyframe != told.Keyframe))
                throw EcorcheException.Damaged("a frame is against keyframe " + told.Keyframe + ", which did not come");
            Prepare(to);
            if (key) to.Level.HasKeyframe = false;
            if (told.Encoding == Encoding.F32) ChooseBox(told, from, to);
            ReadTissues(told, from, to, key);
            if (!key) return;
            to.Level.HasKeyframe = true;
            to.Level.Keyframe = told.Frame;
        }

        private MeshLevel Find(int level)
        {
            for (int i = 0; i < _levels.Count; ++i)
                if (_levels[i].Level == level) return _levels[i];
            throw EcorcheException.Damaged("a frame of level " + level + ", which was not told of");
        }

        private void Prepare(BodyFrame to)
        {
            var parts = to.Level.Parts;
            if (to.Tissues.Length != parts.Length)
            {
                to.Tissues = new TissueVertices[parts.Length];
                for (int i = 0; i < parts.Length; ++i) to.Tissues[i] = new TissueVertices();
            }
            for (int i = 0; i < parts.Length; ++i)
            {
                to.Tissues[i].Tissue = parts[i].Tissue;
                to.Tissues[i].Need(parts[i].VertexCount, _layout);
            }
        }

        /// <summary>Each tissue has its positions, and perhaps its normals, before or behind them.</summary>
        private void ReadTissues(MeshFrame told, FrameBytes from, BodyFrame to, bool key)
        {
            int seen = 0;
            for (int i = 0; i < told.Arrays.Count; ++i)
            {
                var array = told.Arrays[i];
                if (array.Kind != MeshArrayKind.Positions) continue;
                if (seen == to.Level.Parts.Length || to.Level.Parts[seen].Tissue != array.Tissue)
                    throw EcorcheException.Damaged("a frame has other tissues than were asked for");
                var part = to.Level.Parts[seen];
                fixed (ushort* normals = NormalsOf(told, from, i, part.VertexCount))
                fixed (byte* bytes = to.Tissues[seen].Bytes)
                    ReadTissue(told, array.Array, from, part, key, normals, to, bytes);
                ++seen;
            }
            if (seen != to.Level.Parts.Length) throw EcorcheException.Damaged("a frame lacks tissues");
        }

        private static ReadOnlySpan<ushort> NormalsOf(MeshFrame told, FrameBytes from, int positions, int count)
        {
            for (int i = Math.Max(0, positions - 1); i < told.Arrays.Count && i <= positions + 1; ++i)
            {
                var array = told.Arrays[i];
                if (array.Kind != MeshArrayKind.Normals || array.Tissue != told.Arrays[positions].Tissue) continue;
                var found = from.Rows<sbyte>(array.Array, ScalarType.I8, 2);
                if (found.Length != 2 * count) throw EcorcheException.Damaged("a tissue has " + found.Length / 2 + " normals of " + count);
                return MemoryMarshal.Cast<sbyte, ushort>(found);
            }
            return default;
        }

        private void ReadTissue(MeshFrame told, Wire.Array array, FrameBytes from, MeshPart part, bool key, ushort* normals, BodyFrame to, byte* bytes)
        {
            int count = part.VertexCount;
            if (told.Encoding == Encoding.F32)
            {
                var positions = Counted(from.Rows<float>(array, ScalarType.F32, 3), 3 * count);
                fixed (float* f = positions) WriteFloats(f, count, normals, to, bytes);
            }
            else if (told.Encoding == Encoding.U16 || key)
            {
                var numbers = Counted(from.Rows<ushort>(array, ScalarType.U16, 3), 3 * count);
                if (key && part.Key == null) part.Key = new ushort[3 * part.Stride];
                fixed (ushort* n = numbers)
                fixed (ushort* kept = key ? part.Key : null)
                    WriteNumbers(n, count, kept, part.Stride, normals, to, bytes);
            }
            else if (told.Encoding == Encoding.U16Delta)
            {
                var data = from.Rows<byte>(array, ScalarType.U8, 1);
                fixed (byte* d = data)
                fixed (ushort* kept = part.Key)
                    WriteDeltas(d, data.Length, kept, part.Stride, count, normals, to, bytes);
            }
            else
            {
                throw EcorcheException.Damaged("a frame of encoding " + told.Encoding);
            }
        }

        private static ReadOnlySpan<T> Counted<T>(ReadOnlySpan<T> rows, int count)
        {
            return rows.Length == count ? rows : throw EcorcheException.Damaged("a tissue has " + rows.Length / 3 + " vertices of " + count / 3);
        }

        private void WriteDeltas(byte* data, int size, ushort* key, int stride, int count, ushort* normals, BodyFrame to, byte* bytes)
        {
            int at = 0;
            fixed (ulong* room = _room)
            fixed (ulong* planes = _planes)
            {
                for (int first = 0; first < count; first += Deltas.Block)
                {
                    int some = Math.Min(Deltas.Block, count - first);
                    at = Deltas.Decode(data, at, size, key + first, stride, some, room, (ushort*)planes);
                    Write((ushort*)planes, normals == null ? null : normals + first, first, some, to, bytes);
                }
            }
            if (at != size) throw EcorcheException.Damaged("the deltas go on behind their last block");
        }

        private void WriteNumbers(ushort* numbers, int count, ushort* key, int stride, ushort* normals, BodyFrame to, byte* bytes)
        {
            fixed (ulong* room = _planes)
            {
                ushort* planes = (ushort*)room;
                for (int first = 0; first < count; first += Deltas.Block)
                {
                    int some = Math.Min(Deltas.Block, count - first);
                    Vertices.Part(numbers + 3 * first, some, planes, planes + Deltas.Block, planes + 2 * Deltas.Block);
                    for (int c = 0; c < 3 && key != null; ++c)
                        Buffer.MemoryCopy(planes + c * Deltas.Block, key + c * stride + first, 2 * some, 2 * some);
                    Write(planes, normals == null ? null : normals + first, first, some, to, bytes);
                }
            }
        }

        /// <summary>Numbers of a block into vertices.</summary>
        private void Write(ushort* planes, ushort* normals, int first, int count, BodyFrame to, byte* bytes)
        {
            ushort* y = planes + Deltas.Block;
            ushort* z = y + Deltas.Block;
            if (_layout == VertexLayout.Packed)
            {
                Vertices.Pack(planes, y, z, normals, count, (ulong*)bytes + first);
                return;
            }
            var by = new Placing(_axes, to.Low.x, to.Low.y, to.Low.z, to.Step);
            fixed (uint* table = _table) Vertices.Place(planes, y, z, normals, count, by, table, (float*)bytes + 4 * first);
        }

        private void WriteFloats(float* positions, int count, ushort* normals, BodyFrame to, byte* bytes)
        {
            if (_layout == VertexLayout.Float)
            {
                var by = new Placing(_axes, 0, 0, 0, 1);
                fixed (uint* table = _table) Vertices.Place(positions, normals, count, by, table, (float*)bytes);
                return;
            }
            fixed (ulong* room = _planes)
            {
                ushort* planes = (ushort*)room;
                for (int first = 0; first < count; first += Deltas.Block)
                {
                    int some = Math.Min(Deltas.Block, count - first);
                    Vertices.Number(positions + 3 * first, some, to.Low.x, to.Low.y, to.Low.z, to.Step, planes, planes + Deltas.Block, planes + 2 * Deltas.Block);
                    Write(planes, normals == null ? null : normals + first, first, some, to, bytes);
                }
            }
        }

        /// <summary>Floats have no box: packed, they go into the smallest cube that holds all of them.</summary>
        private void ChooseBox(MeshFrame told, FrameBytes from, BodyFrame to)
        {
            if (_layout == VertexLayout.Float)
            {
                to.Step = 0;
                return;
            }
            float x0 = float.PositiveInfinity, y0 = x0, z0 = x0, x1 = -x0, y1 = x1, z1 = x1, sum = 0;
            for (int i = 0; i < told.Arrays.Count; ++i)
            {
                if (told.Arrays[i].Kind != MeshArrayKind.Positions) continue;
                var rows = from.Rows<float>(told.Arrays[i].Array, ScalarType.F32, 3);
                for (int v = 0; v + 2 < rows.Length; v += 3)
                {
                    float x = rows[v], y = rows[v + 1], z = rows[v + 2];
                    (x0, y0, z0) = (Math.Min(x0, x), Math.Min(y0, y), Math.Min(z0, z));
                    (x1, y1, z1) = (Math.Max(x1, x), Math.Max(y1, y), Math.Max(z1, z));
                    sum += (x - x) + (y - y) + (z - z);
                }
            }
            if (sum != 0) throw EcorcheException.Damaged("a position that is not finite");
            double extent = x0 <= x1 ? Math.Max(x1 - (double)x0, Math.Max(y1 - (double)y0, z1 - (double)z0)) : 0;
            to.Step = extent > 0 ? extent / 65535 : 1;
            to.Low = x0 <= x1 ? new Point3(x0, y0, z0) : default;
        }

        private void ReadMotions(MeshFrame told, FrameBytes from, BodyFrame to)
        {
            if (told.Arrays.Count != 1 || told.Arrays[0].Kind != MeshArrayKind.Motions) throw EcorcheException.Damaged("a frame without motions");
            var rows = from.Rows<double>(told.Arrays[0].Array, ScalarType.F64, 7);
            if (rows.Length != 7 * _body.Segments.Count) throw EcorcheException.Damaged("a frame has not a motion for each segment");
            if (to.Motions.Length != rows.Length) to.Motions = new double[rows.Length];
            rows.CopyTo(to.Motions);
        }
    }
}
