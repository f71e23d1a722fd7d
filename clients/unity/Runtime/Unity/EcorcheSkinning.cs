// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using UnityEngine;

namespace Ecorche.Components
{
    /// <summary>Shows a server's body by its segments' motions alone, 56 bytes each a pose: the vertices are skinned on the graphics card.</summary>
    [AddComponentMenu("Ecorche/Skinning")]
    public sealed class EcorcheSkinning : MonoBehaviour
    {
        private const int Group = 64, PointBytes = 16, HungBytes = 32, MotionBytes = 32, PosedBytes = 8;
        private static readonly int Box = Shader.PropertyToID("_Box"), Posed = Shader.PropertyToID("_Posed"), First = Shader.PropertyToID("_First"),
            BodyToWorld = Shader.PropertyToID("_BodyToWorld");

        [Tooltip("With `motions` set")]
        public EcorcheServer server;
        [Tooltip("EcorcheSkinning.compute")]
        public ComputeShader skinning;
        [Tooltip("Of the shader Ecorche/Skinned")]
        public Material material;
        public GroupMaterial[] materials = Array.Empty<GroupMaterial>();

        private readonly List<GraphicsBuffer> _buffers = new List<GraphicsBuffer>();
        private readonly List<Part> _parts = new List<Part>();
        private GraphicsBuffer _motions, _posed;
        private SkinningTable _table;
        private float[] _rows;
        private ulong _number;
        private Bounds _bounds;

        private struct Part
        {
            public GraphicsBuffer Indices;
            public Material Material;
            public MaterialPropertyBlock Block;
        }

        private void OnDisable() => Clear();

        private void LateUpdate()
        {
            var frame = server == null || !server.motions ? null : server.Frame;
            var table = server == null ? null : server.Stream?.Skinning;
            if (frame == null || table == null || frame.Motions.Length == 0) return;
            if (table != _table) Build(table);
            if (frame.Number != _number) Skin(frame);
            foreach (var part in _parts)
            {
                part.Block.SetMatrix(BodyToWorld, transform.localToWorldMatrix);
                Graphics.DrawProcedural(part.Material, _bounds, MeshTopology.Triangles, part.Indices, part.Indices.count, 1, null, part.Block);
            }
        }

        private void Build(SkinningTable table)
        {
            Clear();
            _table = table;
            var body = server.Body;
            Set("points", table.Points, PointBytes, table.PointCount);
            Set("weights", table.Weights, 4, table.Weights.Length);
            Set("hungRows", table.HungRows, 4, table.VertexCount);
            Set("hung", table.Hung, HungBytes, table.Hung.Length / 8);
            _rows = new float[8 * body.Segments.Count];
            _motions = Keep(new GraphicsBuffer(GraphicsBuffer.Target.Structured, body.Segments.Count, MotionBytes));
            _posed = Keep(new GraphicsBuffer(GraphicsBuffer.Target.Structured, table.VertexCount, PosedBytes));
            skinning.SetBuffer(0, "motions", _motions);
            skinning.SetBuffer(0, "posed", _posed);
            foreach (int influences in new[] { 1, 4, 8 }) Choose("INFLUENCES_" + influences, influences == table.Influences);
            foreach (var part in server.Stream.Levels[0].Parts)
            {
                var indices = Keep(new GraphicsBuffer(GraphicsBuffer.Target.Index, part.Triangles.Length, 4));
                indices.SetData(part.Triangles);
                var block = new MaterialPropertyBlock();
                block.SetBuffer(Posed, _posed);
                block.SetInt(First, Array.Find(table.Tissues, one => one.Tissue == part.Tissue).First);
                _parts.Add(new Part { Indices = indices, Material = MaterialOf(body.Tissues[part.Tissue].Group), Block = block });
            }
        }

        private void Skin(BodyFrame frame)
        {
            _number = frame.Number;
            var box = _table.Place(frame.Motions, _rows);
            _motions.SetData(_rows);
            Choose("METHOD_LBS", frame.Skinning == Wire.Skinning.Lbs);
            Choose("METHOD_DQS", frame.Skinning == Wire.Skinning.Dqs);
            Choose("METHOD_COR", frame.Skinning != Wire.Skinning.Lbs && frame.Skinning != Wire.Skinning.Dqs);
            skinning.SetFloat("restStep", (float)_table.Step);
            skinning.SetFloat("posedStep", (float)box.Step);
            skinning.SetInt("vertexCount", _table.VertexCount);
            skinning.Dispatch(0, (_table.VertexCount + Group - 1) / Group, 1, 1);
            foreach (var part in _parts) part.Block.SetVector(Box, new Vector4((float)box.Low.x, (float)box.Low.y, (float)box.Low.z, (float)box.Step));
            var axes = Axes.Of(Space.Unity);
            double half = 32768 * box.Step;
            var middle = axes.Point(box.Low.x + half, box.Low.y + half, box.Low.z + half);
            float size = 2 * (float)(half * axes.Scale);
            // Of the world: turned anyhow, the cube lies in a ball.
            _bounds = new Bounds(transform.TransformPoint(new Vector3((float)middle.x, (float)middle.y, (float)middle.z)), 1.75f * new Vector3(size, size, size));
        }

        private void Choose(string keyword, bool on)
        {
            if (on) skinning.EnableKeyword(keyword);
            else skinning.DisableKeyword(keyword);
        }

        private void Set(string name, uint[] numbers, int stride, int count)
        {
            var buffer = Keep(new GraphicsBuffer(GraphicsBuffer.Target.Structured, count, stride));
            buffer.SetData(numbers);
            skinning.SetBuffer(0, name, buffer);
        }

        private GraphicsBuffer Keep(GraphicsBuffer buffer)
        {
            _buffers.Add(buffer);
            return buffer;
        }

        private Material MaterialOf(string group)
        {
            foreach (var one in materials)
                if (one.group == group) return one.material;
            return material;
        }

        private void Clear()
        {
            foreach (var buffer in _buffers) buffer.Release();
            _buffers.Clear();
            _parts.Clear();
            (_table, _number) = (null, ulong.MaxValue);
        }
    }
}
