// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using UnityEngine;
using UnityEngine.Rendering;

namespace Ecorche.Components
{
    /// <summary>A material for the tissues of a group.</summary>
    [Serializable]
    public struct GroupMaterial
    {
        [Tooltip("skin, bone, muscle, organ, vessel, nerve, cartilage, ligament, fat or other")]
        public string group;
        public Material material;
    }

    /// <summary>Shows a server's body: a mesh for each tissue, written from each frame as it came.</summary>
    [AddComponentMenu("Ecorche/Body")]
    public sealed class EcorcheBody : MonoBehaviour
    {
        private const MeshUpdateFlags Unchecked = MeshUpdateFlags.DontRecalculateBounds | MeshUpdateFlags.DontValidateIndices | MeshUpdateFlags.DontNotifyMeshUsers;
        private const int VertexBytes = 16;

        /// <summary>As VertexLayout.Float writes them.</summary>
        private static readonly VertexAttributeDescriptor[] Layout =
        {
            new VertexAttributeDescriptor(VertexAttribute.Position, VertexAttributeFormat.Float32, 3, 0),
            new VertexAttributeDescriptor(VertexAttribute.Normal, VertexAttributeFormat.SNorm8, 4, 0),
        };

        public EcorcheServer server;
        [Tooltip("For groups that have none of their own")]
        public Material material;
        public GroupMaterial[] materials = Array.Empty<GroupMaterial>();

        private readonly List<Tissue> _tissues = new List<Tissue>();
        private BodyFrame _shown;
        private ulong _number;
        private MeshLevel _level;
        private int _generation;

        private sealed class Tissue
        {
            public GameObject Holder;
            public Mesh Mesh;
        }

        /// <summary>The object of a tissue, to hide it or to give it another material; null until it was shown.</summary>
        public GameObject Find(string tissue)
        {
            foreach (var one in _tissues)
                if (one.Holder.name == tissue) return one.Holder;
            return null;
        }

        private void LateUpdate()
        {
            if (server == null || server.motions) return;
            var frame = server.Frame;
            if (_generation != server.Generation) Clear();
            if (frame == null || frame == _shown && frame.Number == _number) return;
            _generation = server.Generation;
            (_shown, _number) = (frame, frame.Number);
            if (frame.Level != _level) Rebuild(frame);
            for (int i = 0; i < _tissues.Count; ++i)
            {
                var vertices = frame.Tissues[i];
                _tissues[i].Mesh.SetVertexBufferData(vertices.Bytes, 0, 0, VertexBytes * vertices.Count, 0, Unchecked);
                _tissues[i].Mesh.bounds = BoundsOf(frame);
            }
        }

        private void OnDisable() => Clear();

        /// <summary>The box of all tissues, which goes with the root.</summary>
        private static Bounds BoundsOf(BodyFrame frame)
        {
            var axes = Axes.Of(Space.Unity);
            double half = frame.Step > 0 ? 32768 * frame.Step : 2000;
            var low = frame.Step > 0 ? frame.Low : new Point3(-half, -half, -half);
            var middle = axes.Point(low.x + half, low.y + half, low.z + half);
            float size = (float)(2 * half * axes.Scale);
            return new Bounds(new Vector3((float)middle.x, (float)middle.y, (float)middle.z), new Vector3(size, size, size));
        }

        private void Rebuild(BodyFrame frame)
        {
            var parts = frame.Level.Parts;
            if (_tissues.Count != parts.Length)
            {
                Destroy();
                foreach (var part in parts) _tissues.Add(Make(part.Tissue));
            }
            _level = frame.Level;
            for (int i = 0; i < parts.Length; ++i)
            {
                var mesh = _tissues[i].Mesh;
                mesh.Clear();
                mesh.SetVertexBufferParams(parts[i].VertexCount, Layout);
                mesh.SetIndexBufferParams(parts[i].Triangles.Length, IndexFormat.UInt32);
                mesh.SetIndexBufferData(parts[i].Triangles, 0, 0, parts[i].Triangles.Length, Unchecked);
                mesh.subMeshCount = 1;
                mesh.SetSubMesh(0, new SubMeshDescriptor(0, parts[i].Triangles.Length, MeshTopology.Triangles), Unchecked);
            }
        }

        private Tissue Make(int row)
        {
            var told = server.Body.Tissues[row];
            var mesh = new Mesh { name = told.Name };
            mesh.MarkDynamic();
            var holder = new GameObject(told.Name);
            holder.transform.SetParent(transform, false);
            holder.AddComponent<MeshFilter>().sharedMesh = mesh;
            holder.AddComponent<MeshRenderer>().sharedMaterial = MaterialOf(told.Group);
            return new Tissue { Holder = holder, Mesh = mesh };
        }

        private Material MaterialOf(string group)
        {
            foreach (var one in materials)
                if (one.group == group) return one.material;
            return material;
        }

        private void Clear()
        {
            Destroy();
            (_shown, _level) = (null, null);
            _generation = server == null ? 0 : server.Generation;
        }

        private void Destroy()
        {
            foreach (var one in _tissues)
            {
                Destroy(one.Mesh);
                Destroy(one.Holder);
            }
            _tissues.Clear();
        }
    }
}
