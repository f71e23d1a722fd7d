// SPDX-License-Identifier: Apache-2.0
// As UnityEngine.cs, of the editor and of the test framework.
using System;

namespace UnityEditor
{
    public enum MessageType { None, Info, Warning, Error }

    public class Editor : UnityEngine.Object
    {
        public UnityEngine.Object target => throw null;
        public virtual void OnInspectorGUI() { }
        public virtual bool RequiresConstantRepaint() => throw null;
        public bool DrawDefaultInspector() => throw null;
    }

    [AttributeUsage(AttributeTargets.Class)]
    public sealed class CustomEditor : Attribute
    {
        public CustomEditor(Type type) { }
    }

    public static class EditorApplication
    {
        public static bool isPlaying => throw null;
    }

    public static class EditorGUILayout
    {
        public static void HelpBox(string message, MessageType type) { }
    }
}

namespace NUnit.Framework
{
    [AttributeUsage(AttributeTargets.Method)]
    public sealed class TestAttribute : Attribute { }

    public static class Assert
    {
        public static void AreEqual(object expected, object actual) { }
        public static void AreEqual(double expected, double actual, double delta) { }
        public static void IsTrue(bool holds) { }
    }
}
