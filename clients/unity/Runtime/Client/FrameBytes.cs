// SPDX-License-Identifier: Apache-2.0
using System;
using System.Buffers.Binary;
using System.IO;
using System.Runtime.InteropServices;
using Ecorche.Wire;

namespace Ecorche
{
    /// <summary>One frame as it came (docs/reference/protocol.md, "A frame"): kept, and read into again. Trusts nothing.</summary>
    internal sealed class FrameBytes
    {
        private const int Alignment = 16, Head = 8, Step = 1 << 20;
        /// <summary>What no server of ecorche sends more than.</summary>
        private const uint MostEnvelope = 64 << 20, MostPayload = 2000u << 20;

        private byte[] _bytes = new byte[1 << 16];
        private int _envelope, _payloadAt, _payload;

        public ReadOnlySpan<byte> Envelope => _bytes.AsSpan(Head, _envelope);
        public ReadOnlySpan<byte> Payload => _bytes.AsSpan(_payloadAt, _payload);
        public int Size => _payloadAt + _payload;

        public static int Aligned(int size) => (size + Alignment - 1) / Alignment * Alignment;

        /// <summary>Waits for a whole frame. False where the stream ends before it.</summary>
        public bool Read(Stream from)
        {
            if (!Fill(from, 0, Head)) return false;
            uint envelope = BinaryPrimitives.ReadUInt32LittleEndian(_bytes), payload = BinaryPrimitives.ReadUInt32LittleEndian(_bytes.AsSpan(4));
            if (envelope == 0 || envelope > MostEnvelope || payload > MostPayload || payload % Alignment != 0)
                throw EcorcheException.Damaged("a frame of " + envelope + " and " + payload + " bytes");
            _envelope = (int)envelope;
            _payload = (int)payload;
            _payloadAt = Aligned(Head + _envelope);
            if (!Fill(from, Head, _payloadAt)) return false;
            for (int i = Head + _envelope; i < _payloadAt; ++i)
                if (_bytes[i] != 0) throw EcorcheException.Damaged("the padding of a frame is not zero");
            return Fill(from, _payloadAt, Size);
        }

        /// <summary>Room grows with what comes, not with what the head promises.</summary>
        private bool Fill(Stream from, int at, int end)
        {
            while (at < end)
            {
                if (at == _bytes.Length)
                    System.Array.Resize(ref _bytes, (int)Math.Min(Math.Max(2L * at, at + Step), Math.Max(end, at + Step)));
                int got = from.Read(_bytes, at, Math.Min(end, _bytes.Length) - at);
                if (got <= 0) return false;
                at += got;
            }
            return true;
        }

        /// <summary>Writes a frame into `to`, which grows where it must; returns its size.</summary>
        public static int Write(ReadOnlySpan<byte> envelope, ReadOnlySpan<byte> payload, ref byte[] to)
        {
            int payloadAt = Aligned(Head + envelope.Length), padded = Aligned(payload.Length), size = payloadAt + padded;
            if (to.Length < size) to = new byte[Math.Max(size, 2 * to.Length)];
            BinaryPrimitives.WriteUInt32LittleEndian(to, (uint)envelope.Length);
            BinaryPrimitives.WriteUInt32LittleEndian(to.AsSpan(4), (uint)padded);
            envelope.CopyTo(to.AsSpan(Head));
            to.AsSpan(Head + envelope.Length, payloadAt - Head - envelope.Length).Clear();
            payload.CopyTo(to.AsSpan(payloadAt));
            to.AsSpan(payloadAt + payload.Length, padded - payload.Length).Clear();
            return size;
        }

        public static int BytesOf(ScalarType type)
        {
            switch (type)
            {
                case ScalarType.U8: case ScalarType.I8: return 1;
                case ScalarType.U16: case ScalarType.I16: return 2;
                case ScalarType.U32: case ScalarType.I32: case ScalarType.F32: return 4;
                case ScalarType.F64: return 8;
                default: throw EcorcheException.Damaged("an array of type " + type);
            }
        }

        /// <summary>The numbers that `what` names, which must be of this type and lie within the payload.</summary>
        public ReadOnlySpan<T> Rows<T>(Wire.Array what, ScalarType type, int components) where T : struct
        {
            if (what.Type != type || what.Components != components)
                throw EcorcheException.Damaged("an array of type " + what.Type + " x " + what.Components + ", expected " + type + " x " + components);
            int each = components * BytesOf(type);
            if (what.Offset % Alignment != 0 || what.Offset > (ulong)_payload || what.Count > ((ulong)_payload - what.Offset) / (ulong)each)
                throw EcorcheException.Damaged("an array reaches beyond its payload");
            return MemoryMarshal.Cast<byte, T>(Payload.Slice((int)what.Offset, (int)what.Count * each));
        }
    }
}
