// SPDX-License-Identifier: Apache-2.0
// Made by scripts/csharp_messages of proto/ecorche/v1/stream.proto, which says what these mean.
namespace Ecorche.Wire
{
    public sealed class PoseQuality
    {
        public PoseQualityVerdict Verdict;
        public ulong InvertedTets;
        public double InvertedShare;
        public double MinDetF;
        public double VolumeChange;
        public readonly Repeated<TissueChange> Tissues = new Repeated<TissueChange>();
        public double BoneRigidity;
        public double MaxInvertedShare;
        public double MaxVolumeChange;
        public double MaxBoneRigidity;
        public ulong PoseSequence;
        public double UnsignedVolumeChange;
        public bool HasWorstTissue; public uint WorstTissue;
        public readonly Repeated<DoubtfulJoint> Doubtful = new Repeated<DoubtfulJoint>();
        public double TissueFactor;
        public bool HasOverlap; public readonly BoneOverlap Overlap = new BoneOverlap();
        public double MaxBoneOverlap;
        public bool OverlapPending;

        public void Clear()
        {
            Verdict = default;
            InvertedTets = default;
            InvertedShare = default;
            MinDetF = default;
            VolumeChange = default;
            Tissues.Clear();
            BoneRigidity = default;
            MaxInvertedShare = default;
            MaxVolumeChange = default;
            MaxBoneRigidity = default;
            PoseSequence = default;
            UnsignedVolumeChange = default;
            HasWorstTissue = false; WorstTissue = default;
            Doubtful.Clear();
            TissueFactor = default;
            HasOverlap = false;
            MaxBoneOverlap = default;
            OverlapPending = default;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Verdict = (PoseQualityVerdict)from.UInt32(); break;
                    case 16: InvertedTets = from.UInt64(); break;
                    case 25: InvertedShare = from.Double(); break;
                    case 33: MinDetF = from.Double(); break;
                    case 41: VolumeChange = from.Double(); break;
                    case 50: { var inner = from.Message(); Tissues.Add().Read(ref inner); } break;
                    case 57: BoneRigidity = from.Double(); break;
                    case 65: MaxInvertedShare = from.Double(); break;
                    case 73: MaxVolumeChange = from.Double(); break;
                    case 81: MaxBoneRigidity = from.Double(); break;
                    case 88: PoseSequence = from.UInt64(); break;
                    case 97: UnsignedVolumeChange = from.Double(); break;
                    case 104: WorstTissue = from.UInt32(); HasWorstTissue = true; break;
                    case 114: { var inner = from.Message(); Doubtful.Add().Read(ref inner); } break;
                    case 121: TissueFactor = from.Double(); break;
                    case 130: { var inner = from.Message(); Overlap.Read(ref inner); } HasOverlap = true; break;
                    case 137: MaxBoneOverlap = from.Double(); break;
                    case 144: OverlapPending = from.Bool(); break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

    public sealed class BoneOverlap
    {
        public uint Bone;
        public uint Into;
        public double Mm;
        public bool HasAt; public readonly Vector3 At = new Vector3();

        public void Clear()
        {
            Bone = default;
            Into = default;
            Mm = default;
            HasAt = false;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: Bone = from.UInt32(); break;
                    case 16: Into = from.UInt32(); break;
                    case 25: Mm = from.Double(); break;
                    case 34: { var inner = from.Message(); At.Read(ref inner); } HasAt = true; break;
                    default: from.Skip(key); break;
                }
            }
        }
    }

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
