// SPDX-License-Identifier: Apache-2.0
using System;

namespace Ecorche
{
    /// <summary>How a request fared: the numbers of google.rpc.Code, as in the protocol and in the C libraries.</summary>
    public enum Code
    {
        Ok = 0,
        Cancelled = 1,
        Unknown = 2,
        InvalidArgument = 3,
        DeadlineExceeded = 4,
        NotFound = 5,
        AlreadyExists = 6,
        PermissionDenied = 7,
        ResourceExhausted = 8,
        FailedPrecondition = 9,
        Aborted = 10,
        OutOfRange = 11,
        Unimplemented = 12,
        Internal = 13,
        Unavailable = 14,
        DataLoss = 15,
        Unauthenticated = 16,
    }

    /// <summary>The one exception of ecorche: what went wrong, and its kind.</summary>
    public sealed class EcorcheException : Exception
    {
        public EcorcheException(Code code, string message, Exception cause = null) : base(message, cause)
        {
            Code = code;
        }

        public Code Code { get; }

        internal static EcorcheException Damaged(string what) => new EcorcheException(Code.DataLoss, "the server's message is damaged: " + what);
    }
}
