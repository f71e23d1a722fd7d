// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.Threading;
using System.Threading.Tasks;

namespace Ecorche
{
    public enum LinkState
    {
        Connecting,
        /// <summary>Body and Stream are there, and frames come.</summary>
        Open,
        /// <summary>The connection was lost; the thread tries to come back.</summary>
        Lost,
        /// <summary>It will not come back: Error says why.</summary>
        Failed,
    }

    /// <summary>A client on a thread of its own, for a game's loop: it decodes, comes back when the line is lost, and opens a replaced model anew.</summary>
    public sealed class ClientThread : IDisposable
    {
        private const double FirstPause = 0.25, LongestPause = 5;

        private readonly string _address, _model, _session;
        private readonly ClientOptions _options;
        private readonly StreamOptions _stream;
        private readonly Thread _thread;
        private readonly object _lock = new object();
        private readonly Queue<Request> _requests = new Queue<Request>();
        private readonly Random _random = new Random();
        private Client _client;
        private Pose _next, _sending;
        private bool _hasNext, _shownPose, _closed;
        private LinkState _state;

        public ClientThread(string address, ClientOptions options = null, StreamOptions stream = null, string model = "", string session = "")
        {
            (_address, _model, _session) = (address, model, session);
            _options = options ?? new ClientOptions();
            if (session.Length > 0) _options.Session = _options.Session ?? session;
            _stream = stream ?? new StreamOptions();
            _thread = new Thread(Run) { IsBackground = true, Name = "ecorche client" };
            _thread.Start();
        }

        public LinkState State
        {
            get
            {
                lock (_lock) return _state;
            }
        }

        /// <summary>What went wrong last; null: nothing.</summary>
        public EcorcheException Error { get; private set; }
        /// <summary>Grows with each model that was opened: what was built for the last one is no good then. 0: none yet.</summary>
        public int Generation { get; private set; }
        public Body Body { get; private set; }
        public MeshStream Stream { get; private set; }
        public bool Controls { get; private set; }

        /// <summary>Sends a copy of the pose as soon as it can; the newest wins. After the line was lost it is sent again.</summary>
        public void SetPose(Pose pose)
        {
            lock (_lock)
            {
                if (_next == null || _next.Rotation.Length != pose.Rotation.Length) return;
                pose.Rotation.AsSpan().CopyTo(_next.Rotation);
                (_next.Root, _next.Skinning) = (pose.Root, pose.Skinning);
                _hasNext = true;
                _client.Wake();
            }
        }

        /// <summary>Runs a request, such as client => client.Probe(points), between frames.</summary>
        public Task<T> Ask<T>(Func<Client, T> request)
        {
            var answer = new TaskCompletionSource<T>(TaskCreationOptions.RunContinuationsAsynchronously);
            lock (_lock)
            {
                if (_closed || State != LinkState.Open)
                {
                    answer.SetException(new EcorcheException(Code.Unavailable, "the client is not connected"));
                    return answer.Task;
                }
                _requests.Enqueue(new Request { Run = () => answer.TrySetResult(request(_client)), Fail = error => answer.TrySetException(error) });
                _client.Wake();
            }
            return answer.Task;
        }

        public void Dispose()
        {
            lock (_lock)
            {
                _closed = true;
                Monitor.PulseAll(_lock);
                _client?.Wake();
            }
            _thread.Join();
        }

        private void Run()
        {
            double pause = FirstPause;
            while (!_closed)
            {
                try
                {
                    if (_client == null) OpenAnew();
                    else if (State == LinkState.Lost) ComeBack();
                    pause = FirstPause;
                    while (!_closed) Serve();
                }
                catch (EcorcheException error)
                {
                    if (!Survives(error)) break;
                    Wait(pause * (1 + _random.NextDouble()));
                    pause = Math.Min(2 * pause, LongestPause);
                }
            }
            _client?.Dispose();
            FailRequests(Error ?? new EcorcheException(Code.Cancelled, "the client was closed"));
        }

        private void OpenAnew()
        {
            var client = Client.Connect(_address, _options);
            try
            {
                var body = client.Open(_model, _session);
                var stream = client.Subscribe(_stream);
                lock (_lock)
                {
                    (_client, Body, Stream) = (client, body, stream);
                    (_next, _sending) = (client.NewPose(), client.NewPose());
                    (_hasNext, _shownPose, Controls, Error) = (false, false, client.Controls, null);
                    ++Generation;
                    _state = LinkState.Open;
                }
            }
            catch
            {
                client.Dispose();
                throw;
            }
        }

        private void ComeBack()
        {
            _client.Resume();
            lock (_lock)
            {
                _hasNext |= _shownPose;
                (_state, Error, Controls) = (LinkState.Open, null, _client.Controls);
            }
        }

        private void Serve()
        {
            bool send;
            Request request = null;
            lock (_lock)
            {
                send = _hasNext;
                _hasNext = false;
                if (send)
                {
                    _next.Rotation.AsSpan().CopyTo(_sending.Rotation);
                    (_sending.Root, _sending.Skinning) = (_next.Root, _next.Skinning);
                    _shownPose = true;
                }
                if (_requests.Count > 0) request = _requests.Dequeue();
            }
            if (send) _client.SendPose(_sending);
            if (request != null) Answer(request);
            bool more;
            lock (_lock) more = _hasNext || _requests.Count > 0;
            var came = _client.Poll(more ? 0 : 100);
            Controls = _client.Controls;
            if (came.Kind != EventKind.ModelChanged) return;
            Forget();
            throw new EcorcheException(Code.Unavailable, "the server has read the model anew");
        }

        private void Forget()
        {
            _client.Dispose();
            lock (_lock)
            {
                (_client, _next) = (null, null);
                _state = LinkState.Connecting;
            }
            FailRequests(new EcorcheException(Code.Aborted, "the model was replaced"));
        }

        private static void Answer(Request request)
        {
            try
            {
                request.Run();
            }
            catch (Exception error)
            {
                request.Fail(error);
                if (error is EcorcheException known && known.Code == Code.Unavailable) throw;
            }
        }

        private void FailRequests(EcorcheException why)
        {
            lock (_lock)
                while (_requests.Count > 0) _requests.Dequeue().Fail(why);
        }

        private sealed class Request
        {
            public Action Run;
            public Action<Exception> Fail;
        }

        /// <summary>False where another try would be refused alike.</summary>
        private bool Survives(EcorcheException error)
        {
            bool replaced = _client != null && State == LinkState.Lost && error.Code == Code.FailedPrecondition;
            if (replaced) Forget();
            bool again = replaced || error.Code == Code.Unavailable || error.Code == Code.DeadlineExceeded || error.Code == Code.Aborted
                || error.Code == Code.DataLoss || error.Code == Code.ResourceExhausted;
            lock (_lock)
            {
                Error = error;
                if (!again) _state = LinkState.Failed;
                else if (_client != null) _state = LinkState.Lost;
            }
            return again;
        }

        private void Wait(double seconds)
        {
            lock (_lock)
                if (!_closed) Monitor.Wait(_lock, TimeSpan.FromSeconds(seconds));
        }
    }
}
