// SPDX-License-Identifier: Apache-2.0
// Made by scripts/csharp_messages of proto/ecorche/v1/envelope.proto, which says what these mean.
namespace Ecorche.Wire
{
    public sealed class Envelope
    {
        public ulong RequestId;
        public bool HasClientHello; public readonly ClientHello ClientHello = new ClientHello();
        public bool HasListModels; public readonly ListModels ListModels = new ListModels();
        public bool HasOpenModel; public readonly OpenModel OpenModel = new OpenModel();
        public bool HasSubscribe; public readonly Subscribe Subscribe = new Subscribe();
        public bool HasUnsubscribe; public readonly Unsubscribe Unsubscribe = new Unsubscribe();
        public bool HasPoseUpdate; public readonly PoseUpdate PoseUpdate = new PoseUpdate();
        public bool HasFrameAck; public readonly FrameAck FrameAck = new FrameAck();
        public bool HasClaimControl; public readonly ClaimControl ClaimControl = new ClaimControl();
        public bool HasReleaseControl; public readonly ReleaseControl ReleaseControl = new ReleaseControl();
        public bool HasProbePoints; public readonly ProbePoints ProbePoints = new ProbePoints();
        public bool HasListClips; public readonly ListClips ListClips = new ListClips();
        public bool HasPlayClip; public readonly PlayClip PlayClip = new PlayClip();
        public bool HasPing; public readonly Ping Ping = new Ping();
        public bool HasPong; public readonly Pong Pong = new Pong();
        public bool HasStatus; public readonly Status Status = new Status();
        public bool HasGoodbye; public readonly Goodbye Goodbye = new Goodbye();
        public bool HasServerHello; public readonly ServerHello ServerHello = new ServerHello();
        public bool HasModelList; public readonly ModelList ModelList = new ModelList();
        public bool HasModelOpened; public readonly ModelOpened ModelOpened = new ModelOpened();
        public bool HasSubscribed; public readonly Subscribed Subscribed = new Subscribed();
        public bool HasPoseAck; public readonly PoseAck PoseAck = new PoseAck();
        public bool HasMeshFrame; public readonly MeshFrame MeshFrame = new MeshFrame();
        public bool HasVolumeFrame; public readonly VolumeFrame VolumeFrame = new VolumeFrame();
        public bool HasControlGranted; public readonly ControlGranted ControlGranted = new ControlGranted();
        public bool HasControlChanged; public readonly ControlChanged ControlChanged = new ControlChanged();
        public bool HasProbed; public readonly Probed Probed = new Probed();
        public bool HasClipList; public readonly ClipList ClipList = new ClipList();
        public bool HasModelChanged; public readonly ModelChanged ModelChanged = new ModelChanged();

        public void Clear()
        {
            RequestId = default;
            HasClientHello = false;
            HasListModels = false;
            HasOpenModel = false;
            HasSubscribe = false;
            HasUnsubscribe = false;
            HasPoseUpdate = false;
            HasFrameAck = false;
            HasClaimControl = false;
            HasReleaseControl = false;
            HasProbePoints = false;
            HasListClips = false;
            HasPlayClip = false;
            HasPing = false;
            HasPong = false;
            HasStatus = false;
            HasGoodbye = false;
            HasServerHello = false;
            HasModelList = false;
            HasModelOpened = false;
            HasSubscribed = false;
            HasPoseAck = false;
            HasMeshFrame = false;
            HasVolumeFrame = false;
            HasControlGranted = false;
            HasControlChanged = false;
            HasProbed = false;
            HasClipList = false;
            HasModelChanged = false;
        }

        internal void Read(ref WireReader from)
        {
            Clear();
            for (uint key; (key = from.Key()) != 0;)
            {
                switch (key)
                {
                    case 8: RequestId = from.UInt64(); break;
                    case 322: { var inner = from.Message(); Ping.Read(ref inner); } HasPing = true; break;
                    case 330: { var inner = from.Message(); Pong.Read(ref inner); } HasPong = true; break;
                    case 338: { var inner = from.Message(); Status.Read(ref inner); } HasStatus = true; break;
                    case 346: { var inner = from.Message(); Goodbye.Read(ref inner); } HasGoodbye = true; break;
                    case 482: { var inner = from.Message(); ServerHello.Read(ref inner); } HasServerHello = true; break;
                    case 490: { var inner = from.Message(); ModelList.Read(ref inner); } HasModelList = true; break;
                    case 498: { var inner = from.Message(); ModelOpened.Read(ref inner); } HasModelOpened = true; break;
                    case 506: { var inner = from.Message(); Subscribed.Read(ref inner); } HasSubscribed = true; break;
                    case 514: { var inner = from.Message(); PoseAck.Read(ref inner); } HasPoseAck = true; break;
                    case 522: { var inner = from.Message(); MeshFrame.Read(ref inner); } HasMeshFrame = true; break;
                    case 530: { var inner = from.Message(); VolumeFrame.Read(ref inner); } HasVolumeFrame = true; break;
                    case 538: { var inner = from.Message(); ControlGranted.Read(ref inner); } HasControlGranted = true; break;
                    case 546: { var inner = from.Message(); ControlChanged.Read(ref inner); } HasControlChanged = true; break;
                    case 554: { var inner = from.Message(); Probed.Read(ref inner); } HasProbed = true; break;
                    case 570: { var inner = from.Message(); ClipList.Read(ref inner); } HasClipList = true; break;
                    case 578: { var inner = from.Message(); ModelChanged.Read(ref inner); } HasModelChanged = true; break;
                    default: from.Skip(key); break;
                }
            }
        }

        internal void Write(WireWriter to)
        {
            if (HasGoodbye) { int end = to.Size; Goodbye.Write(to); to.Close(346, end); }
            if (HasStatus) { int end = to.Size; Status.Write(to); to.Close(338, end); }
            if (HasPong) { int end = to.Size; Pong.Write(to); to.Close(330, end); }
            if (HasPing) { int end = to.Size; Ping.Write(to); to.Close(322, end); }
            if (HasPlayClip) { int end = to.Size; PlayClip.Write(to); to.Close(186, end); }
            if (HasListClips) { int end = to.Size; ListClips.Write(to); to.Close(178, end); }
            if (HasProbePoints) { int end = to.Size; ProbePoints.Write(to); to.Close(154, end); }
            if (HasReleaseControl) { int end = to.Size; ReleaseControl.Write(to); to.Close(146, end); }
            if (HasClaimControl) { int end = to.Size; ClaimControl.Write(to); to.Close(138, end); }
            if (HasFrameAck) { int end = to.Size; FrameAck.Write(to); to.Close(130, end); }
            if (HasPoseUpdate) { int end = to.Size; PoseUpdate.Write(to); to.Close(122, end); }
            if (HasUnsubscribe) { int end = to.Size; Unsubscribe.Write(to); to.Close(114, end); }
            if (HasSubscribe) { int end = to.Size; Subscribe.Write(to); to.Close(106, end); }
            if (HasOpenModel) { int end = to.Size; OpenModel.Write(to); to.Close(98, end); }
            if (HasListModels) { int end = to.Size; ListModels.Write(to); to.Close(90, end); }
            if (HasClientHello) { int end = to.Size; ClientHello.Write(to); to.Close(82, end); }
            if (RequestId != 0) to.UInt64(8, RequestId);
        }
    }
}
