// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using Ecorche.Wire;

namespace Ecorche
{
    public enum EventKind
    {
        /// <summary>Nothing more came.</summary>
        None,
        /// <summary>A stream has a new frame: <see cref="MeshStream.Take"/>.</summary>
        Frame,
        /// <summary>A volume is new.</summary>
        Volume,
        /// <summary>A pose was taken (Code is Ok), or refused for Message.</summary>
        Pose,
        /// <summary>Client.Controls changed, or control is free (Vacant).</summary>
        Control,
        /// <summary>The server has read the model anew: connect again for the new one.</summary>
        ModelChanged,
    }

    public struct ClientEvent
    {
        public EventKind Kind;
        public Code Code;
        public string Message;
        /// <summary>Of Frame, Volume and Pose: which pose.</summary>
        public ulong Sequence;
        /// <summary>Of Control: a claim is granted now.</summary>
        public bool Vacant;
    }

    /// <summary>Shows a body that an ecorche server poses (docs/reference/protocol.md).</summary>
    /// <remarks>
    /// For one thread at a time: messages are answered and frames are decoded within <see cref="Poll"/> and within what waits for an answer.
    /// <see cref="ClientThread"/> does so beside a game's loop. After Unavailable the connection is gone: <see cref="Resume"/> comes back.
    /// </remarks>
    public sealed partial class Client : IDisposable
    {
        private string _host, _otherHost;
        private int _port, _otherPort;
        private readonly ClientOptions _options;
        private readonly Envelope _in = new Envelope(), _out = new Envelope(), _reply = new Envelope();
        private readonly WireWriter _writer = new WireWriter();
        private readonly Queue<ClientEvent> _events = new Queue<ClientEvent>();
        private readonly List<MeshStream> _streams = new List<MeshStream>();
        private readonly List<VolumeStream> _volumes = new List<VolumeStream>();
        private readonly string _session;
        private Line _line;
        private ulong _requests, _sequence;
        private long _received;

        private Client(string address, ClientOptions options)
        {
            SetAddress(address);
            _options = options ?? new ClientOptions();
            _session = _options.Session ?? Guid.NewGuid().ToString("N");
        }

        private void SetAddress(string address)
        {
            int colon = address.LastIndexOf(':');
            if (colon <= 0 || !int.TryParse(address.Substring(colon + 1), out int port) || port < 1 || port > 65535)
                throw new EcorcheException(Code.InvalidArgument, "address: '" + address + "' is no HOST:PORT (for example 127.0.0.1:7070)");
            (_otherHost, _otherPort) = (_host, _port);
            _host = address.Substring(0, colon).Trim('[', ']');
            _port = port;
        }

        /// <summary>"127.0.0.1:7070". Waits as long as the options say.</summary>
        /// <exception cref="EcorcheException">Unavailable: nobody answers there. Unauthenticated: another token. FailedPrecondition: another version.</exception>
        public static Client Connect(string address, ClientOptions options = null)
        {
            var client = new Client(address, options);
            client.Greet(System.Array.Empty<byte>());
            return client;
        }

        /// <summary>What the server is and allows.</summary>
        public ServerHello Server { get; private set; }

        /// <summary>Null until one is opened.</summary>
        public Body Body { get; private set; }

        /// <summary>This client poses the session; others look on.</summary>
        public bool Controls { get; private set; }

        /// <summary>Bytes received so far.</summary>
        public long Received => _received + (_line?.Received ?? 0);

        /// <summary>The next thing that came. Waits for one as long as this; 0: never, for a game's loop.</summary>
        public ClientEvent Poll(int milliseconds = 0)
        {
            int until = unchecked(Environment.TickCount + milliseconds);
            for (;;)
            {
                if (_events.Count > 0) return _events.Dequeue();
                var came = _line.Take(Math.Max(0, unchecked(until - Environment.TickCount)));
                if (came == null) return default;
                using (new Returned(_line, came)) Attend(came);
            }
        }

        /// <summary>Sends the whole pose, and does not wait. What the frame that shows it will say.</summary>
        public ulong SendPose(Pose pose)
        {
            var update = Begin(_out).PoseUpdate;
            _out.HasPoseUpdate = true;
            update.Clear();
            update.Sequence = ++_sequence;
            update.RigDigest = Opened().RigDigest;
            update.HasRootTranslation = true;
            var root = pose.Root;
            (update.RootTranslation.X, update.RootTranslation.Y, update.RootTranslation.Z) = (root.x, root.y, root.z);
            foreach (double number in pose.Rotation) update.Rotation.Append(number);
            update.Skinning = pose.Skinning;
            Send(_out, default);
            return _sequence;
        }

        /// <summary>From any thread: a Poll that waits returns.</summary>
        internal void Wake() => _line?.Wake();

        /// <summary>Says goodbye, so that its control is free at once. Waits for the server to hear it, half a second at most.</summary>
        public void Dispose()
        {
            if (_line == null) return;
            Begin(_out).HasGoodbye = true;
            _out.Goodbye.Clear();
            _writer.Begin();
            _out.Write(_writer);
            _line.Leave(_writer.Written);
            _line.Dispose();
        }

        private void Greet(byte[] resumeToken)
        {
            _line?.Dispose();
            try
            {
                var line = new Line(_host, _port, _options);
                (_received, _line) = (Received, line);
                var hello = Begin(_out).ClientHello;
                _out.HasClientHello = true;
                hello.Clear();
                hello.ProtocolMin = hello.ProtocolMax = 1;
                hello.Client = _options.Name;
                hello.Token = System.Text.Encoding.UTF8.GetBytes(_options.Token ?? "");
                hello.ResumeToken = resumeToken;
                hello.Session = _session;
                for (var one = Encoding.F32; one <= Encoding.U16Delta; ++one) hello.Encodings.Append(one);
                var told = Keep(Call(default), envelope => envelope.HasServerHello);
                if (told.ServerHello.Protocol != 1)
                    throw new EcorcheException(Code.FailedPrecondition, "the server speaks protocol " + told.ServerHello.Protocol + ", this client 1");
                Server = told.ServerHello;
            }
            catch
            {
                _line?.Dispose();
                // Who was sent here tries next where it was before.
                if (_otherHost != null) (_host, _port, _otherHost, _otherPort) = (_otherHost, _otherPort, _host, _port);
                throw;
            }
        }

        private Body Opened() => Body ?? throw new EcorcheException(Code.FailedPrecondition, "no model is open (call Open)");

        private static Envelope Begin(Envelope envelope)
        {
            envelope.Clear();
            return envelope;
        }

        private void Send(Envelope envelope, ReadOnlySpan<byte> payload)
        {
            _writer.Begin();
            envelope.Write(_writer);
            _line.Send(_writer.Written, payload);
        }

        /// <summary>Sends _out and waits for its answer, which is in _in; other messages become events. Release what is returned.</summary>
        private FrameBytes Call(ReadOnlySpan<byte> payload)
        {
            ulong request = _out.RequestId = ++_requests;
            try
            {
                Send(_out, payload);
            }
            catch (EcorcheException)
            {
                // Why the server hung up may have come before that.
            }
            int until = unchecked(Environment.TickCount + (int)(1000 * _options.Timeout));
            for (;;)
            {
                var came = _line.Take(Math.Max(1, unchecked(until - Environment.TickCount)));
                if (came == null && unchecked(until - Environment.TickCount) > 0) continue;  // woken
                if (came == null) throw new EcorcheException(Code.DeadlineExceeded, "the server does not answer within " + _options.Timeout + " s");
                bool keep = false;
                try
                {
                    Attend(came);
                    keep = _in.RequestId == request && !_in.HasPing;
                    if (keep && _in.HasStatus && _in.Status.Code != 0) throw Refused(_in.Status);
                    if (keep) return came;
                }
                catch
                {
                    keep = false;
                    throw;
                }
                finally
                {
                    if (!keep) _line.Release(came);
                }
            }
        }

        /// <summary>An answer that outlives the next message: read once more, by itself.</summary>
        private Envelope Keep(FrameBytes came, Func<Envelope, bool> expected)
        {
            using (new Returned(_line, came))
            {
                var kept = new Envelope();
                var reader = new WireReader(came.Envelope);
                kept.Read(ref reader);
                return expected(kept) ? kept : throw EcorcheException.Damaged("it answers with something else");
            }
        }

        private static EcorcheException Refused(Status status)
        {
            return new EcorcheException(status.Code <= 16 ? (Code)status.Code : Code.Unknown, status.Message);
        }

        /// <summary>Reads a message into _in, and does what the protocol asks of every client at once.</summary>
        private void Attend(FrameBytes came)
        {
            var reader = new WireReader(came.Envelope);
            _in.Read(ref reader);
            if (_in.HasMeshFrame) TakeMesh(_in.MeshFrame, came);
            else if (_in.HasVolumeFrame) TakeVolume(_in.VolumeFrame, came);
            else if (_in.HasPoseAck) TakeAck(_in.PoseAck);
            else if (_in.HasPing) Answer(_in);
            else if (_in.HasControlChanged) TakeControl(_in.ControlChanged.Role == Role.Controller, _in.ControlChanged.Vacant);
            else if (_in.HasControlGranted && _in.RequestId == 0)
            {
                _sequence = Math.Max(_sequence, _in.ControlGranted.LastSequence);
                TakeControl(true, false);
            }
            else if (_in.HasModelChanged) _events.Enqueue(new ClientEvent { Kind = EventKind.ModelChanged });
            else if (_in.HasGoodbye)
            {
                // Resume then goes to the other server.
                if (_in.Goodbye.Elsewhere.Length > 0) SetAddress(_in.Goodbye.Elsewhere);
                throw Refused(_in.Goodbye.Status);
            }
            else if (_in.HasStatus && _in.RequestId == 0) throw Refused(_in.Status);
        }

        private void TakeControl(bool controls, bool vacant)
        {
            Controls = controls;
            _events.Enqueue(new ClientEvent { Kind = EventKind.Control, Vacant = vacant });
        }

        private void TakeAck(PoseAck ack)
        {
            // Of poses that the server played, too: ours go on from there.
            _sequence = Math.Max(_sequence, ack.Sequence);
            _events.Enqueue(new ClientEvent { Kind = EventKind.Pose, Code = (Code)ack.Status.Code, Message = ack.Status.Message, Sequence = ack.Sequence });
        }

        private void Answer(Envelope ping)
        {
            Begin(_reply).HasPong = true;
            _reply.RequestId = ping.RequestId;
            _reply.Pong.Data = ping.Ping.Data;
            Send(_reply, default);
        }

        private void Acknowledge(uint subscription, ulong frame)
        {
            Begin(_reply).HasFrameAck = true;
            _reply.FrameAck.Subscription = subscription;
            _reply.FrameAck.Frame = frame;
            Send(_reply, default);
        }

        private void TakeMesh(MeshFrame told, FrameBytes came)
        {
            Acknowledge(told.Subscription, told.Frame);
            for (int i = 0; i < _streams.Count; ++i)
            {
                if (_streams[i].Subscription != told.Subscription) continue;
                _streams[i].Decode(told, came);
                _events.Enqueue(new ClientEvent { Kind = EventKind.Frame, Sequence = told.PoseSequence });
            }
        }

        private void TakeVolume(VolumeFrame told, FrameBytes came)
        {
            Acknowledge(told.Subscription, told.Frame);
            for (int i = 0; i < _volumes.Count; ++i)
            {
                if (_volumes[i].Subscription != told.Subscription) continue;
                var code = _volumes[i].Decode(told, came);
                _events.Enqueue(new ClientEvent { Kind = EventKind.Volume, Sequence = told.PoseSequence, Code = code, Message = told.Status.Message });
            }
        }

        /// <summary>Gives a frame's bytes back.</summary>
        private readonly struct Returned : IDisposable
        {
            private readonly Line _line;
            private readonly FrameBytes _bytes;

            public Returned(Line line, FrameBytes bytes)
            {
                _line = line;
                _bytes = bytes;
            }

            public void Dispose() => _line.Release(_bytes);
        }
    }
}
