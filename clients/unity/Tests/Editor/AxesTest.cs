// SPDX-License-Identifier: Apache-2.0
using Ecorche.Components;
using NUnit.Framework;
using UnityEngine;

namespace Ecorche.Tests
{
    /// <summary>What needs Unity to be seen; the client itself is tested in ecorche's own repository, under Mono.</summary>
    public sealed class AxesTest
    {
        [Test]
        public void LeftIsLeft()
        {
            // 100 mm to the left, 200 to the back, 300 up.
            var point = Axes.Of(Space.Unity).Point(100, 200, 300);
            Assert.AreEqual(-0.1, point.x, 1e-9);
            Assert.AreEqual(0.3, point.y, 1e-9);
            Assert.AreEqual(-0.2, point.z, 1e-9);
        }

        [Test]
        public void TurnsAreUnitys()
        {
            // A quarter about the patient's up axis takes left to back; in Unity -x to -z.
            var turn = Axes.Of(Space.Unity).Rotation(new Turn(0, 0, System.Math.Sqrt(0.5), System.Math.Sqrt(0.5)));
            var moved = new Quaternion { x = (float)turn.x, y = (float)turn.y, z = (float)turn.z, w = (float)turn.w } * new Vector3(-1, 0, 0);
            Assert.AreEqual(0, moved.x, 1e-6);
            Assert.AreEqual(-1, moved.z, 1e-6);
        }

        [Test]
        public void AServerThatIsNotThereIsTold()
        {
            var holder = new GameObject("server");
            var server = holder.AddComponent<EcorcheServer>();
            Assert.IsTrue(server.State == LinkState.Connecting);
            UnityEngine.Object.DestroyImmediate(holder);
        }
    }
}
