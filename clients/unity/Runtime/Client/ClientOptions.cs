// SPDX-License-Identifier: Apache-2.0
namespace Ecorche
{
    /// <summary>How one connects.</summary>
    public sealed class ClientOptions
    {
        /// <summary>That the server's log has.</summary>
        public string Name = "ecorche unity";

        /// <summary>Of the right to connect; null: none.</summary>
        public string Token;

        /// <summary>That will be opened, by which a balancer in front of several servers chooses one; null: this client's own.</summary>
        public string Session;

        /// <summary>By TLS, trusting what this system trusts.</summary>
        public bool Tls;

        /// <summary>By TLS, trusting these certificates (PEM text) and no others: those of the server, or of who signed them.</summary>
        public string Authorities;

        /// <summary>Seconds that an answer may take, a connection included.</summary>
        public double Timeout = 10;
    }
}
