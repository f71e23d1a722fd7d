// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.IO;
using System.Net.Security;
using System.Net.Sockets;
using System.Security.Authentication;
using System.Threading;

namespace Ecorche
{
    /// <summary>A connection: a thread that reads frames, and what waits to be taken.</summary>
    /// <remarks>
    /// Why a thread: neither a game's loop nor a decoder may wait for the network, and TLS cannot be asked whether it holds something. A server has
    /// few frames on their way until they are acknowledged; should it not keep to that, the thread waits.
    /// </remarks>
    internal sealed class Line : IDisposable
    {
        private const int MostWaiting = 64;

        private readonly Socket _socket;
        private readonly Stream _stream;
        private readonly Thread _reader;
        private readonly object _lock = new object();
        private readonly Queue<FrameBytes> _came = new Queue<FrameBytes>();
        private readonly Stack<FrameBytes> _spent = new Stack<FrameBytes>();
        private EcorcheException _ended;
        private bool _closed, _leaving, _woken;
        private byte[] _out = new byte[4096];
        private long _received;

        /// <exception cref="EcorcheException">Unavailable: nobody answers there, or by other certificates than trusted ones.</exception>
        public Line(string host, int port, ClientOptions options)
        {
            _socket = Connect(host, port, options.Timeout);
            try
            {
                _socket.NoDelay = true;
                _stream = new NetworkStream(_socket, false);
                if (options.Tls || options.Authorities != null) _stream = Secure(_stream, host, options);
            }
            catch
            {
                _socket.Dispose();
                throw;
            }
            _reader = new Thread(ReadOn) { IsBackground = true, Name = "ecorche reader" };
            _reader.Start();
        }

        public long Received => Interlocked.Read(ref _received);

        private static Socket Connect(string host, int port, double seconds)
        {
            var socket = new Socket(SocketType.Stream, ProtocolType.Tcp);
            try
            {
                var connecting = socket.BeginConnect(host, port, null, null);
                if (!connecting.AsyncWaitHandle.WaitOne(TimeSpan.FromSeconds(seconds)))
                    throw new EcorcheException(Code.Unavailable, host + ":" + port + ": nobody answers within " + seconds + " s (is ecorche serve running there?)");
                socket.EndConnect(connecting);
                return socket;
            }
            catch (SocketException error)
            {
                socket.Dispose();
                throw new EcorcheException(Code.Unavailable, host + ":" + port + ": " + error.Message + " (is ecorche serve running there?)", error);
            }
            catch
            {
                socket.Dispose();
                throw;
            }
        }

        private static Stream Secure(Stream plain, string host, ClientOptions options)
        {
            var pinned = options.Authorities == null ? null : new Pinned(options.Authorities);
            var secure = new SslStream(plain, false, pinned == null ? null : new RemoteCertificateValidationCallback(pinned.Accepts));
            try
            {
                secure.AuthenticateAsClient(host, null, SslProtocols.Tls12, false);
                return secure;
            }
            catch (Exception error) when (error is AuthenticationException || error is IOException)
            {
                secure.Dispose();
                throw new EcorcheException(Code.Unavailable, host + ": its certificate is not trusted, or it does not speak TLS (" + error.Message + ")", error);
            }
        }

        private void ReadOn()
        {
            EcorcheException why = null;
            try
            {
                for (;;)
                {
                    FrameBytes next;
                    lock (_lock)
                    {
                        while (_came.Count >= MostWaiting && !_closed && !_leaving) Monitor.Wait(_lock);
                        if (_closed) return;
                        next = _spent.Count > 0 ? _spent.Pop() : new FrameBytes();
                    }
                    if (!next.Read(_stream)) break;
                    Interlocked.Add(ref _received, next.Size);
                    lock (_lock)
                    {
                        if (_leaving) _spent.Push(next);
                        else _came.Enqueue(next);
                        Monitor.PulseAll(_lock);
                    }
                }
            }
            catch (EcorcheException error)
            {
                why = error;
            }
            catch (Exception error)
            {
                // Which exceptions a socket or TLS throws where it was closed under its reader depends on the runtime.
                why = new EcorcheException(Code.Unavailable, "the connection was lost: " + error.Message, error);
            }
            lock (_lock)
            {
                _ended = why ?? new EcorcheException(Code.Unavailable, "the connection was lost: the server hung up");
                Monitor.PulseAll(_lock);
            }
        }

        /// <summary>The next frame; null where none comes within `milliseconds`. Give it back by <see cref="Release"/>.</summary>
        /// <exception cref="EcorcheException">The connection has ended, and nothing more waits.</exception>
        public FrameBytes Take(int milliseconds)
        {
            lock (_lock)
            {
                int until = unchecked(Environment.TickCount + milliseconds);
                while (_came.Count == 0)
                {
                    if (_ended != null) throw _ended;
                    int left = unchecked(until - Environment.TickCount);
                    if (left <= 0 || _woken)
                    {
                        _woken = false;
                        return null;
                    }
                    Monitor.Wait(_lock, left);
                }
                var next = _came.Dequeue();
                if (_came.Count == MostWaiting - 1) Monitor.PulseAll(_lock);
                return next;
            }
        }

        /// <summary>Whoever waits in Take, or does so next, need not wait longer.</summary>
        public void Wake()
        {
            lock (_lock)
            {
                _woken = true;
                Monitor.PulseAll(_lock);
            }
        }

        public void Release(FrameBytes spent)
        {
            lock (_lock) _spent.Push(spent);
        }

        public void Send(ReadOnlySpan<byte> envelope, ReadOnlySpan<byte> payload)
        {
            int size = FrameBytes.Write(envelope, payload, ref _out);
            try
            {
                _stream.Write(_out, 0, size);
            }
            catch (Exception error) when (error is IOException || error is ObjectDisposedException)
            {
                // Why the server hung up may still wait to be read.
                throw new EcorcheException(Code.Unavailable, "the connection was lost: " + error.Message, error);
            }
        }

        /// <summary>Sends a last message, and waits until the server hangs up on it, half a second at most. Nothing comes any more.</summary>
        /// <remarks>What is still on its way is read: to close over unread bytes resets the connection, and the message may be lost with it.</remarks>
        public void Leave(ReadOnlySpan<byte> envelope)
        {
            const int longest = 500;
            lock (_lock)
            {
                if (_closed) return;
                _leaving = true;
                Monitor.PulseAll(_lock);
            }
            try
            {
                _socket.SendTimeout = longest;
                Send(envelope, default);
                _reader.Join(longest);
            }
            catch (Exception error) when (error is EcorcheException || error is SocketException)
            {
                // It was lost before.
            }
        }

        public void Dispose()
        {
            lock (_lock)
            {
                if (_closed) return;
                _closed = true;
                Monitor.PulseAll(_lock);
            }
            try
            {
                _socket.Shutdown(SocketShutdown.Both);
            }
            catch (SocketException)
            {
                // It was lost before.
            }
            _socket.Dispose();
            _reader.Join();
            _stream.Dispose();
        }
    }
}
