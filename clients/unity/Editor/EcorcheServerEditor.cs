// SPDX-License-Identifier: Apache-2.0
using Ecorche.Components;
using UnityEditor;

namespace Ecorche.Editor
{
    /// <summary>Says beneath the settings how the connection is.</summary>
    [CustomEditor(typeof(EcorcheServer))]
    internal sealed class EcorcheServerEditor : UnityEditor.Editor
    {
        public override bool RequiresConstantRepaint() => EditorApplication.isPlaying;

        public override void OnInspectorGUI()
        {
            DrawDefaultInspector();
            var server = (EcorcheServer)target;
            if (server.tls == false && server.authorities == null && server.token.Length > 0)
                EditorGUILayout.HelpBox("Without TLS anybody on the way can read the token.", MessageType.Warning);
            if (!EditorApplication.isPlaying) return;
            string told = server.State.ToString();
            if (server.Body != null) told += ": " + server.Body.Model + ", session " + server.Body.Session + (server.Controls ? ", in control" : ", looking on");
            if (server.Frame != null) told += ", pose " + server.Frame.PoseSequence + (server.Frame.Quality.Passes ? ", pass" : ", warn");
            EditorGUILayout.HelpBox(server.Error == null ? told : told + "\n" + server.Error.Message, server.Error == null ? MessageType.Info : MessageType.Warning);
        }
    }
}
