// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using Ecorche.Wire;

namespace Ecorche
{
    /// <summary>What one wants to see.</summary>
    public sealed class StreamOptions
    {
        /// <summary>Names; empty: all.</summary>
        public string[] Tissues = System.Array.Empty<string>();
        public Encoding Encoding = Encoding.U16Delta;
        public bool Normals = true;
        public VertexLayout Layout = VertexLayout.Float;
        public Space Space = Space.Unity;
        /// <summary>Of detail, 0 (all) to 3.</summary>
        public int Level;
        /// <summary>The server may send coarser levels while the body moves, over a slow line.</summary>
        public bool Adaptive;
        /// <summary>Frames a second; 0: every pose.</summary>
        public double MaxRate;
        /// <summary>A pose is measured before its frame leaves, in a whole body's time.</summary>
        public bool Quality;
        /// <summary>Only what lies in this box in the scan, LPS mm: min x, y, z, max x, y, z. Null: everything.</summary>
        public double[] Region;
        /// <summary>Only the motions of the segments, for who skins by itself: <see cref="MeshStream.Skinning"/>.</summary>
        public bool Motions;
    }

    /// <summary>Frames of one subscription, decoded as they are read; the newest wins.</summary>
    /// <remarks>Take may be called by another thread than the client's: three frames go round, one shown, one being written, one that waits.</remarks>
    public sealed class MeshStream
    {
        private readonly object _lock = new object();
        private readonly Stack<BodyFrame> _spare = new Stack<BodyFrame>();
        private readonly FrameDecoder _decoder;
        private BodyFrame _newest, _taken;
        private Quality _quality;

        internal MeshStream(StreamOptions options, Body body)
        {
            Options = options;
            _decoder = new FrameDecoder(options, body);
            for (int i = 0; i < 3; ++i) _spare.Push(new BodyFrame());
        }

        public StreamOptions Options { get; }

        /// <summary>Its number at the server; changes where the client comes back.</summary>
        public uint Subscription { get; internal set; }

        /// <summary>Levels that may come. Those of whole tissues are there from the beginning.</summary>
        public IReadOnlyList<MeshLevel> Levels => _decoder.Levels;

        /// <summary>Under StreamOptions.Motions: what vertices are skinned by.</summary>
        public SkinningTable Skinning { get; private set; }

        internal void Begin(Subscribed told, FrameBytes from)
        {
            Subscription = told.Subscription;
            _decoder.Begin(told, from);
            if (told.HasSkinning) Skinning = new SkinningTable(told.Skinning, from);
        }

        internal void ForgetKeyframes() => _decoder.ForgetKeyframes();

        /// <summary>The newest frame, which is the caller's until the next call; null where none has come since the last one.</summary>
        public BodyFrame Take()
        {
            lock (_lock)
            {
                if (_newest == null) return null;
                if (_taken != null) _spare.Push(_taken);
                _taken = _newest;
                _newest = null;
                return _taken;
            }
        }

        internal void Decode(MeshFrame told, FrameBytes from)
        {
            BodyFrame next;
            lock (_lock) next = _spare.Pop();
            try
            {
                if (told.HasQuality) _quality = Quality.From(told.Quality);
                next.Quality = _quality;
                _decoder.Decode(told, from, next);
            }
            catch
            {
                lock (_lock) _spare.Push(next);
                throw;
            }
            lock (_lock)
            {
                if (_newest != null) _spare.Push(_newest);
                _newest = next;
            }
        }
    }
}
