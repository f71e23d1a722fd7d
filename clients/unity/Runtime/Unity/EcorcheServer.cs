// SPDX-License-Identifier: Apache-2.0
using System.Threading.Tasks;
using Ecorche.Wire;
using UnityEngine;

namespace Ecorche.Components
{
    /// <summary>A connection to an ecorche server, and the body it poses. Frames are decoded on a thread of their own.</summary>
    [AddComponentMenu("Ecorche/Server")]
    [DefaultExecutionOrder(-100)]
    public sealed class EcorcheServer : MonoBehaviour
    {
        [Tooltip("HOST:PORT of ecorche serve --listen")]
        public string address = "127.0.0.1:7070";
        [Tooltip("Of the right to connect; empty: none")]
        public string token = "";
        [Tooltip("By TLS")]
        public bool tls;
        [Tooltip("By TLS, trusting the certificates of this PEM text and no others")]
        public TextAsset authorities;
        [Tooltip("Empty: the server's first")]
        public string model = "";
        [Tooltip("Others who name it see the same body; empty: one of its own")]
        public string session = "";
        [Tooltip("Names; none: all")]
        public string[] tissues = System.Array.Empty<string>();
        [Range(0, 3), Tooltip("Of detail; 0: all")]
        public int level;
        [Tooltip("Coarser levels while the body moves, over a slow line")]
        public bool adaptive = true;
        [Tooltip("Only motions come, and EcorcheSkinning moves the vertices on the graphics card")]
        public bool motions;

        private ClientThread _thread;
        private int _shown;

        /// <summary>How the connection is; Lost comes back by itself.</summary>
        public LinkState State => _thread == null ? LinkState.Connecting : _thread.State;

        /// <summary>What went wrong last; null: nothing.</summary>
        public EcorcheException Error => _thread?.Error;

        /// <summary>Grows with each model that was opened.</summary>
        public int Generation => _thread == null ? 0 : _thread.Generation;

        public Body Body => _thread?.Body;

        /// <summary>The newest frame, for all components alike; null: none yet.</summary>
        public BodyFrame Frame { get; private set; }

        public MeshStream Stream => _thread?.Stream;

        /// <summary>This client poses the body; others look on.</summary>
        public bool Controls => _thread != null && _thread.Controls;

        /// <summary>With the first frame, so that settings made beside AddComponent count.</summary>
        private void Connect()
        {
            var options = new ClientOptions { Token = token.Length == 0 ? null : token, Tls = tls, Authorities = authorities == null ? null : authorities.text };
            var stream = new StreamOptions { Tissues = tissues, Level = level, Adaptive = adaptive && !motions, Motions = motions, Encoding = Encoding.U16Delta };
            _thread = new ClientThread(address, options, stream, model, session);
        }

        private void OnDisable()
        {
            _thread?.Dispose();
            _thread = null;
            Frame = null;
        }

        private void Update()
        {
            if (_thread == null) Connect();
            if (_shown != _thread.Generation)
            {
                _shown = _thread.Generation;
                Frame = null;
            }
            Frame = _thread.Stream?.Take() ?? Frame;
        }

        /// <summary>Sends a pose; the newest wins.</summary>
        public void SetPose(Pose pose) => _thread?.SetPose(pose);

        /// <summary>Where points of the world on the posed body lie in the scan (LPS mm, NaN outside), and which tissues hold them.</summary>
        public Task<Probed> Probe(Transform body, params UnityEngine.Vector3[] points)
        {
            if (_thread == null) return Task.FromException<Probed>(new EcorcheException(Code.Unavailable, "the client is not connected"));
            var axes = Axes.Of(Space.Unity);
            var numbers = new double[3 * points.Length];
            for (int i = 0; i < points.Length; ++i)
            {
                var local = body.InverseTransformPoint(points[i]);
                var lps = axes.PointBack(local.x, local.y, local.z);
                numbers[3 * i] = lps.x;
                numbers[3 * i + 1] = lps.y;
                numbers[3 * i + 2] = lps.z;
            }
            return _thread.Ask(client => client.Probe(numbers, true, true));
        }
    }
}
