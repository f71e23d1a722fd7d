// SPDX-License-Identifier: Apache-2.0
// All that users of the library need.
export { adapt, type Adaptation } from "./adapt.js";
export * from "./client.js";
export type * from "./client_events.js";
export * from "./errors.js";
export { arrayOf, ProtocolError, type KnownScalar, type Numbers } from "./framing.js";
export type { Statistics } from "./channel.js";
export type { IkOptions } from "./ik.js";
export type { MeshLayout, TissueRange } from "./layout.js";
export { MeshStream, type BodyFrame, type MeshOptions } from "./mesh_stream.js";
export { gridOf, VolumeDecoder, type Inflate, type VolumeGrid, type VolumeImage } from "./volume/decoder.js";
export { fetchVolume, VolumeStream, type VolumeOptions, type VolumeShown } from "./volume/stream.js";
export { Policy, type Choice, type Observed } from "./policy.js";
export type { Pose } from "./pose_sender.js";
export type { Probed, ProbeOptions } from "./probe.js";
export type { Spheres } from "./spheres.js";
export type { ConnectionState, ControlState, StateChange } from "./states.js";
export { NO_NORMAL, STRIDE, type Quantisation } from "./decode/packed.js";
export * from "./gen/ecorche/v1/common_pb.js";
export * from "./gen/ecorche/v1/command_pb.js";
export * from "./gen/ecorche/v1/hello_pb.js";
export * from "./gen/ecorche/v1/model_pb.js";
export * from "./gen/ecorche/v1/stream_pb.js";
