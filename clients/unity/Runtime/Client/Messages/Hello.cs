// SPDX-License-Identifier: Apache-2.0
// Made by scripts/csharp_messages of proto/ecorche/v1/hello.proto, which says what these mean.
namespace Ecorche.Wire
{
    public enum Feature
    {
        Unspecified = 0,
        Volumes = 1,
        Quality = 2,
        Control = 3,
        Resume = 4,
        Record = 5,
        Probe = 6,
        InverseKinematics = 7,
        Clips = 8,
        Reload = 9,
        Spheres = 10,
        Thresholds = 20,
        Pose = 30,
        ClipState = 31,
        Presence = 32,
        Skinning = 33,
        Radiograph = 35,
        Fields = 36,
        HangSpheres = 39,
        Settle = 44,
    }

    public sealed class ClientHello
    {
        public uint ProtocolMin;
        public uint ProtocolMax;
        public string Client = "";
        public readonly Repeated<Feature> Features = new Repeated<Feature>();
        public readonly Repeated<Encoding> Encodings = new Repeated<Encoding>();
        public byte[] Token = System.Array.Empty<byte>();
        public byte[] ResumeToken = System.Array.Empty<byte>();
        public string Name = "";
        public string Session = "";

        public void Clear()
        {
            ProtocolMin = default;
            ProtocolMax = default;
            Client = "";
            Features.Clear();
            Encodings.Clear();
            Token = System.Array.Empty<byte>();
            ResumeToken = System.Array.Empty<byte>();
            Name = "";
            Session = "";
        }

        internal void Write(WireWriter to)
        {
            if (Session.Length > 0) to.String(74, Session);
            if (Name.Length > 0) to.String(66, Name);
            if (ResumeToken.Length > 0) to.Bytes(58, ResumeToken);
            if (Token.Length > 0) to.Bytes(50, Token);
            if (Encodings.Count > 0) { int end = to.Size; for (int i = Encodings.Count; --i >= 0;) to.UInt32((uint)Encodings[i]); to.Close(42, end); }
            if (Features.Count > 0) { int end = to.Size; for (int i = Features.Count; --i >= 0;) to.UInt32((uint)Features[i]); to.Close(34, end); }
            if (Client.Length > 0) to.String(26, Client);
            if (ProtocolMax != 0) to.UInt32(16, ProtocolMax);
            if (ProtocolMin != 0) to.UInt32(8, ProtocolMin);
        }
    }

    public sealed class ServerHello
    {
        public uint Protocol;
        public string Server = "";
        public readonly Repeated<Feature> Features = new Repeated<Feature>();
        public readonly Repeated<Encoding> Encodings = new Repeated<Encoding>();
        public bool HasLimits; public readonly Limits Limits = new Limits();
        public byte[] ResumeToken = System.Array.Empty<byte>();
        public bool HasResumed; public readonly Resumed Resumed = new Resumed();
        public ulong Connection;

        public void Clear()
        {
            Protocol = default;
            Server = "";
            Features.Clear();
            Encodings.Clear();
            HasLimits = false;
            ResumeToken = System.Array.Empty<byte>();
            HasResumed = false;
            Connection = default;
        }

        internal void Read(ref WireReader from)
        {
            var oldServer = Server;
            var oldResumeToken = ResumeToken;
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Protocol = from.UInt32(); break;
                    case 18: Server = from.String(oldServer); break;
                    case 24: Features.Append((Feature)from.UInt32()); break;
                    case 26: { var inner = from.Message(); while (!inner.AtEnd) Features.Append((Feature)inner.UInt32()); } break;
                    case 32: Encodings.Append((Encoding)from.UInt32()); break;
                    case 34: { var inner = from.Message(); while (!inner.AtEnd) Encodings.Append((Encoding)inner.UInt32()); } break;
                    case 42: { var inner = from.Message(); Limits.Read(ref inner); } HasLimits = true; break;
                    case 50: ResumeToken = from.Bytes(oldResumeToken); break;
                    case 58: { var inner = from.Message(); Resumed.Read(ref inner); } HasResumed = true; break;
                    case 64: Connection = from.UInt64(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class Resumed
    {
        public string Model = "";
        public string Session = "";
        public Role Role;
        public ulong LastSequence;
        public readonly Repeated<ResumedSubscription> Subscriptions = new Repeated<ResumedSubscription>();
        public bool HasPose; public readonly PoseState Pose = new PoseState();

        public void Clear()
        {
            Model = "";
            Session = "";
            Role = default;
            LastSequence = default;
            Subscriptions.Clear();
            HasPose = false;
        }

        internal void Read(ref WireReader from)
        {
            var oldModel = Model;
            var oldSession = Session;
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 10: Model = from.String(oldModel); break;
                    case 18: Session = from.String(oldSession); break;
                    case 24: Role = (Role)from.UInt32(); break;
                    case 32: LastSequence = from.UInt64(); break;
                    case 42: { var inner = from.Message(); Subscriptions.Add().Read(ref inner); } break;
                    case 50: { var inner = from.Message(); Pose.Read(ref inner); } HasPose = true; break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class ResumedSubscription
    {
        public uint Was;
        public uint Is;

        public void Clear()
        {
            Was = default;
            Is = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Was = from.UInt32(); break;
                    case 16: Is = from.UInt32(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class Limits
    {
        public uint HelloBytes;
        public double HelloSeconds;
        public uint EnvelopeBytes;
        public uint PayloadBytes;
        public uint Connections;
        public uint Sessions;
        public uint Subscriptions;
        public double PosesPerSecond;
        public double MessagesPerSecond;
        public uint FramesInFlight;
        public double StallSeconds;
        public double IdleSeconds;
        public double LingerSeconds;
        public ulong VolumeVoxels;
        public ulong QueuedBytes;
        public double RequestsPerSecond;
        public ulong KeptBytes;
        public ulong RecordBytes;
        public ulong FrameBytes;
        public double PeerShare;
        public double ConnectionShare;

        public void Clear()
        {
            HelloBytes = default;
            HelloSeconds = default;
            EnvelopeBytes = default;
            PayloadBytes = default;
            Connections = default;
            Sessions = default;
            Subscriptions = default;
            PosesPerSecond = default;
            MessagesPerSecond = default;
            FramesInFlight = default;
            StallSeconds = default;
            IdleSeconds = default;
            LingerSeconds = default;
            VolumeVoxels = default;
            QueuedBytes = default;
            RequestsPerSecond = default;
            KeptBytes = default;
            RecordBytes = default;
            FrameBytes = default;
            PeerShare = default;
            ConnectionShare = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: HelloBytes = from.UInt32(); break;
                    case 17: HelloSeconds = from.Double(); break;
                    case 24: EnvelopeBytes = from.UInt32(); break;
                    case 32: PayloadBytes = from.UInt32(); break;
                    case 40: Connections = from.UInt32(); break;
                    case 48: Sessions = from.UInt32(); break;
                    case 56: Subscriptions = from.UInt32(); break;
                    case 65: PosesPerSecond = from.Double(); break;
                    case 73: MessagesPerSecond = from.Double(); break;
                    case 80: FramesInFlight = from.UInt32(); break;
                    case 89: StallSeconds = from.Double(); break;
                    case 97: IdleSeconds = from.Double(); break;
                    case 105: LingerSeconds = from.Double(); break;
                    case 112: VolumeVoxels = from.UInt64(); break;
                    case 120: QueuedBytes = from.UInt64(); break;
                    case 129: RequestsPerSecond = from.Double(); break;
                    case 136: KeptBytes = from.UInt64(); break;
                    case 144: RecordBytes = from.UInt64(); break;
                    case 152: FrameBytes = from.UInt64(); break;
                    case 161: PeerShare = from.Double(); break;
                    case 169: ConnectionShare = from.Double(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class Ping
    {
        public byte[] Data = System.Array.Empty<byte>();

        public void Clear()
        {
            Data = System.Array.Empty<byte>();
        }

        internal void Read(ref WireReader from)
        {
            var oldData = Data;
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 10: Data = from.Bytes(oldData); break;
                    default: from.Skip(key); break;
                }
            }
        }

        internal void Write(WireWriter to)
        {
            if (Data.Length > 0) to.Bytes(10, Data);
        }
    }

    public sealed class Pong
    {
        public byte[] Data = System.Array.Empty<byte>();

        public void Clear()
        {
            Data = System.Array.Empty<byte>();
        }

        internal void Read(ref WireReader from)
        {
            var oldData = Data;
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 10: Data = from.Bytes(oldData); break;
                    default: from.Skip(key); break;
                }
            }
        }

        internal void Write(WireWriter to)
        {
            if (Data.Length > 0) to.Bytes(10, Data);
        }
    }

    public sealed class Goodbye
    {
        public bool HasStatus; public readonly Status Status = new Status();
        public double RetrySeconds;
        public string Elsewhere = "";

        public void Clear()
        {
            HasStatus = false;
            RetrySeconds = default;
            Elsewhere = "";
        }

        internal void Read(ref WireReader from)
        {
            var oldElsewhere = Elsewhere;
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 10: { var inner = from.Message(); Status.Read(ref inner); } HasStatus = true; break;
                    case 17: RetrySeconds = from.Double(); break;
                    case 26: Elsewhere = from.String(oldElsewhere); break;
                    default: from.Skip(key); break;
                }
            }
        }

        internal void Write(WireWriter to)
        {
            if (Elsewhere.Length > 0) to.String(26, Elsewhere);
            if (RetrySeconds != 0) to.Double(17, RetrySeconds);
            if (HasStatus) { int end = to.Size; Status.Write(to); to.Close(10, end); }
        }
    }
}
