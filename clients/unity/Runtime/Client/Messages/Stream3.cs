// SPDX-License-Identifier: Apache-2.0
// Made by scripts/csharp_messages of proto/ecorche/v1/stream.proto, which says what these mean.
namespace Ecorche.Wire
{
    public sealed class DoubtfulJoint
    {
        public uint Joint;
        public double Turned;
        public double Confidence;

        public void Clear()
        {
            Joint = default;
            Turned = default;
            Confidence = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Joint = from.UInt32(); break;
                    case 17: Turned = from.Double(); break;
                    case 25: Confidence = from.Double(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class TissueChange
    {
        public uint Tissue;
        public bool HasShare; public double Share;
        public double ShareError;
        public double MaxShare;

        public void Clear()
        {
            Tissue = default;
            HasShare = false; Share = default;
            ShareError = default;
            MaxShare = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Tissue = from.UInt32(); break;
                    case 17: Share = from.Double(); HasShare = true; break;
                    case 25: ShareError = from.Double(); break;
                    case 33: MaxShare = from.Double(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }
}
