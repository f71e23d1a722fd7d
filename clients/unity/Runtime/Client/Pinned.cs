// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.Net.Security;
using System.Security.Cryptography.X509Certificates;

namespace Ecorche
{
    /// <summary>Certificates that are trusted instead of the system's.</summary>
    internal sealed class Pinned
    {
        private readonly List<X509Certificate2> _trusted = new List<X509Certificate2>();

        /// <exception cref="EcorcheException">InvalidArgument: there is no certificate in it.</exception>
        public Pinned(string pem)
        {
            const string begin = "-----BEGIN CERTIFICATE-----", end = "-----END CERTIFICATE-----";
            for (int at = 0; (at = pem.IndexOf(begin, at, StringComparison.Ordinal)) >= 0;)
            {
                int last = pem.IndexOf(end, at, StringComparison.Ordinal);
                if (last < 0) break;
                try
                {
                    _trusted.Add(new X509Certificate2(Convert.FromBase64String(pem.Substring(at + begin.Length, last - at - begin.Length).Trim())));
                }
                catch (Exception error) when (error is FormatException || error is System.Security.Cryptography.CryptographicException)
                {
                    break;
                }
                at = last;
            }
            if (_trusted.Count == 0)
                throw new EcorcheException(Code.InvalidArgument, "authorities: hold no certificate (give the text of a PEM file)");
        }

        /// <summary>Whether the server's certificate is for its host, and is a trusted one or signed by one.</summary>
        public bool Accepts(object sender, X509Certificate certificate, X509Chain given, SslPolicyErrors errors)
        {
            const SslPolicyErrors never = SslPolicyErrors.RemoteCertificateNameMismatch | SslPolicyErrors.RemoteCertificateNotAvailable;
            if (certificate == null || (errors & never) != 0) return false;
            using (var own = new X509Certificate2(certificate))
            using (var chain = new X509Chain())
            {
                chain.ChainPolicy.RevocationMode = X509RevocationMode.NoCheck;
                chain.ChainPolicy.VerificationFlags = X509VerificationFlags.AllowUnknownCertificateAuthority;
                foreach (var one in _trusted) chain.ChainPolicy.ExtraStore.Add(one);
                if (given != null)
                    foreach (var element in given.ChainElements) chain.ChainPolicy.ExtraStore.Add(element.Certificate);
                if (!chain.Build(own)) return false;
                // From the server's own up: beyond a trusted one nothing matters, and below it every signature was checked.
                foreach (var element in chain.ChainElements)
                    foreach (var one in _trusted)
                        if (element.Certificate.RawData.AsSpan().SequenceEqual(one.RawData)) return true;
                return false;
            }
        }
    }
}
