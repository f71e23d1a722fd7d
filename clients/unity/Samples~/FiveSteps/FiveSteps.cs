// SPDX-License-Identifier: Apache-2.0
using Ecorche;
using Ecorche.Components;
using UnityEngine;

/// <summary>Five steps: put this on an empty object, and a material into it. Press play beside `ecorche serve patient.hdf`.</summary>
public sealed class FiveSteps : MonoBehaviour
{
    public Material material;
    private EcorcheServer _server;
    private Ecorche.Pose _pose;  // UnityEngine has one, too
    private bool _probed;

    private void Start()
    {
        _server = gameObject.AddComponent<EcorcheServer>();           // 1. connect: 127.0.0.1:7070, and 2. open: its first model
        var body = gameObject.AddComponent<EcorcheBody>();            // 4. draw: a mesh for each tissue
        body.server = _server;
        body.material = material;
    }

    private async void Update()
    {
        if (_server.State != LinkState.Open) return;
        if (_pose == null) _pose = new Ecorche.Pose(_server.Body);
        _server.SetPose(_pose.SetAngle("elbow_left", "flexion", 0.8 + 0.6 * Mathf.Sin(Time.time)));  // 3. pose: radians
        if (_probed || _server.Frame == null) return;
        _probed = true;
        var found = await _server.Probe(transform, transform.TransformPoint(new Vector3(0, 1, 0)));  // 5. probe: what is 1 m up?
        int tissue = found.Tissues[0];
        Debug.Log(tissue < 0 ? "nothing" : _server.Body.Tissues[tissue].Name);
    }
}
