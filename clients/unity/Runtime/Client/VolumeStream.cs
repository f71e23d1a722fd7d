// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.Linq;
using System.Runtime.InteropServices;
using Ecorche.Wire;

namespace Ecorche
{
    /// <summary>Frames of a posed volume, or of planes through it.</summary>
    public sealed class VolumeStream
    {
        private const int Brick = 32;
        private readonly int _bytesPerVoxel;
        private readonly Volume _volume;
        private readonly ZstdDecoder _zstd;
        private readonly long _pixels;  // of all slices
        private byte[] _key = System.Array.Empty<byte>(), _voxels = System.Array.Empty<byte>(), _content = System.Array.Empty<byte>();
        private ulong _keyframe;
        private bool _hasKey;
        private int _size;

        internal VolumeStream(Body body, string name, bool nearest, bool changedBricks, double[] region, double maxRate, bool compressed, bool spheres,
            IReadOnlyList<SlicePlane> slices)
        {
            (Name, Nearest, ChangedBricks, Region, MaxRate, Spheres) = (name, nearest, changedBricks, region, maxRate, spheres);
            Slices = slices == null ? System.Array.Empty<SlicePlane>() : slices.ToArray();
            foreach (var slice in Slices) _pixels += (long)slice.SizeU * slice.SizeV;
            for (int v = 0; v < body.Volumes.Count; ++v)
                if (body.Volumes[v].Name == name) _volume = body.Volumes[v];
            if (_volume == null) throw new EcorcheException(Code.NotFound, name + ": the model has no such volume");
            if (compressed) _zstd = new ZstdDecoder();
            _bytesPerVoxel = (int)_volume.Components * FrameBytes.BytesOf(_volume.Type);
        }

        public string Name { get; }
        public uint Subscription { get; private set; }
        public ScalarType Type => _volume.Type;
        /// <summary>Numbers of a voxel, side by side.</summary>
        public int Components => (int)_volume.Components;
        /// <summary>The planes that were asked for; none: the volume, or its region.</summary>
        public IReadOnlyList<SlicePlane> Slices { get; }
        /// <summary>Voxels along i, j and k; 0 of slices, as `Origin`, `Spacing` and `Direction` are.</summary>
        public int SizeI { get; private set; }
        public int SizeJ { get; private set; }
        public int SizeK { get; private set; }
        /// <summary>Of voxel 0, 0, 0, LPS mm.</summary>
        public Point3 Origin { get; private set; }
        public Point3 Spacing { get; private set; }
        /// <summary>Nine, row by row; its columns are the axes of i, j and k.</summary>
        public double[] Direction { get; } = new double[9];
        public ulong PoseSequence { get; private set; }
        /// <summary>i fastest, little-endian; of slices one after another, u fastest. Until the next frame.</summary>
        public ReadOnlySpan<byte> Voxels => _voxels.AsSpan(0, _size);

        /// <summary>Pixels of a slice, u fastest, little-endian; none before the first frame. Until the next frame.</summary>
        public ReadOnlySpan<byte> SliceVoxels(int row)
        {
            if (row < 0 || row >= Slices.Count) throw new ArgumentOutOfRangeException(nameof(row), row, "the stream has " + Slices.Count + " slices");
            int before = 0;
            for (int i = 0; i < row; ++i) before += Bytes(Slices[i]);
            return _size == 0 ? default : Voxels.Slice(before, Bytes(Slices[row]));
        }

        /// <summary>How many bricks the last frame replaced; 0: it brought all voxels.</summary>
        public int Bricks { get; private set; }

        internal bool Nearest { get; }
        internal bool ChangedBricks { get; }
        internal bool Compressed => _zstd != null;
        internal double[] Region { get; }
        internal double MaxRate { get; }
        internal bool Spheres { get; }

        internal void Begin(uint subscription)
        {
            Subscription = subscription;
            _hasKey = false;
        }

        /// <summary>Not Ok: the server says why there are no voxels; those before stay.</summary>
        internal Code Decode(VolumeFrame told, FrameBytes from)
        {
            if (told.HasStatus && told.Status.Code != 0) return (Code)told.Status.Code;
            if (told.HasContent != Compressed || told.HasGrid != (Slices.Count == 0)) throw EcorcheException.Damaged("a volume that was not asked for so");
            long voxels = Slices.Count == 0 ? (long)told.Grid.SizeI * told.Grid.SizeJ * told.Grid.SizeK : _pixels;
            if (Slices.Count == 0 && (told.Grid.SizeI > 65536 || told.Grid.SizeJ > 65536 || told.Grid.SizeK > 65536) || voxels * _bytesPerVoxel > int.MaxValue)
                throw EcorcheException.Damaged("a volume of " + voxels + " voxels");
            int size = (int)voxels * _bytesPerVoxel;
            var rows = Compressed ? Content(told, from, size) : Bytes(told.Voxels, from);
            if (!told.HasBricks)
            {
                if (rows.Length != size) throw EcorcheException.Damaged("a volume of " + rows.Length + " bytes of " + size);
                if (_voxels.Length < size) _voxels = new byte[size];
                rows.CopyTo(_voxels);
                _size = size;
                SetGrid(told);
                Bricks = 0;
                if (!ChangedBricks || told.Keyframe != told.Frame) return Code.Ok;
                if (_key.Length != size) _key = new byte[size];
                rows.CopyTo(_key);
                (_hasKey, _keyframe) = (true, told.Frame);
                return Code.Ok;
            }
            if (!_hasKey || told.Keyframe != _keyframe || _key.Length != size)
                throw EcorcheException.Damaged("a volume is against keyframe " + told.Keyframe + ", which did not come");
            _key.AsSpan().CopyTo(_voxels);
            _size = size;
            SetGrid(told);
            var bricks = from.Rows<uint>(told.Bricks, ScalarType.U32, 1);
            PutBricks(bricks, rows);
            Bricks = bricks.Length;
            return Code.Ok;
        }

        private int Bytes(SlicePlane slice) => slice.SizeU * slice.SizeV * _bytesPerVoxel;

        private ReadOnlySpan<byte> Bytes(Wire.Array array, FrameBytes from)
        {
            int components = (int)_volume.Components;
            switch (FrameBytes.BytesOf(_volume.Type))
            {
                case 1: return from.Rows<byte>(array, _volume.Type, components);
                case 2: return MemoryMarshal.AsBytes(from.Rows<ushort>(array, _volume.Type, components));
                case 4: return MemoryMarshal.AsBytes(from.Rows<uint>(array, _volume.Type, components));
                default: return MemoryMarshal.AsBytes(from.Rows<ulong>(array, _volume.Type, components));
            }
        }

        /// <summary>What the zstd frame holds: at most all voxels.</summary>
        private ReadOnlySpan<byte> Content(VolumeFrame told, FrameBytes from, int most)
        {
            var packed = from.Rows<byte>(told.Voxels, ScalarType.U8, 1);
            if (told.Content.Type != _volume.Type || told.Content.Components != _volume.Components || told.Content.Count > (ulong)(most / _bytesPerVoxel))
                throw EcorcheException.Damaged("a volume of " + told.Content.Count + " voxels of type " + told.Content.Type + " in " + most + " bytes");
            int size = (int)told.Content.Count * _bytesPerVoxel;
            _zstd.Decode(packed, size, ref _content);
            return _content.AsSpan(0, size);
        }

        private void SetGrid(VolumeFrame told)
        {
            PoseSequence = told.PoseSequence;
            if (Slices.Count > 0) return;
            var grid = told.Grid;
            if (grid.Direction.Count != 9) throw EcorcheException.Damaged("a grid without its direction");
            (SizeI, SizeJ, SizeK) = ((int)grid.SizeI, (int)grid.SizeJ, (int)grid.SizeK);
            Origin = new Point3(grid.Origin.X, grid.Origin.Y, grid.Origin.Z);
            Spacing = new Point3(grid.Spacing.X, grid.Spacing.Y, grid.Spacing.Z);
            grid.Direction.Span.CopyTo(Direction);
        }

        /// <summary>docs/reference/protocol.md, "Parts of a body": 32^3 voxels each, the last ones along an axis cut short.</summary>
        private void PutBricks(ReadOnlySpan<uint> bricks, ReadOnlySpan<byte> rows)
        {
            long along = (SizeI + Brick - 1) / Brick, across = (SizeJ + Brick - 1) / Brick, up = (SizeK + Brick - 1) / Brick;
            foreach (uint brick in bricks)
            {
                if (brick >= along * across * up) throw EcorcheException.Damaged("a brick that the grid has not");
                int i = (int)(brick % along) * Brick, j = (int)(brick / along % across) * Brick, k = (int)(brick / (along * across)) * Brick;
                int wide = Math.Min(Brick, SizeI - i) * _bytesPerVoxel;
                for (int z = k; z < Math.Min(k + Brick, SizeK); ++z)
                {
                    for (int y = j; y < Math.Min(j + Brick, SizeJ); ++y)
                    {
                        if (rows.Length < wide) throw EcorcheException.Damaged("the bricks end too early");
                        rows.Slice(0, wide).CopyTo(_voxels.AsSpan(((z * SizeJ + y) * SizeI + i) * _bytesPerVoxel));
                        rows = rows.Slice(wide);
                    }
                }
            }
            if (rows.Length != 0) throw EcorcheException.Damaged("the bricks go on behind their last one");
        }
    }
}
