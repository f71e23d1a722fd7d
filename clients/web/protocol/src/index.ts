// SPDX-License-Identifier: Apache-2.0
// All that users of the library need.
export { adapt, type Adaptation, type AdaptedOptions, type AdaptOptions, type Held } from "./adapt.js";
export * from "./client.js";
export type * from "./client_events.js";
export * from "./errors.js";
export { arrayOf, ProtocolError, type KnownScalar } from "./framing.js";
export type { Statistics } from "./channel.js";
export type { IkOptions } from "./ik.js";
export { LinePolicy, type LineSeen } from "./line.js";
export type { Field, FieldOptions, Radiograph, RadiographOptions } from "./inspect.js";
export { RenderRadiograph_Content as RadiographContent, RenderRadiograph_View as RadiographView } from "./gen/ecorche/v1/inspect_pb.js";
export type { MeshLayout, TissueRange } from "./layout.js";
export { MeshStream, type BodyFrame, type MeshOptions } from "./mesh_stream.js";
export { Policy, type Choice, type Observed } from "./policy.js";
export { skinOnCpu } from "./skinning/cpu.js";
export type { GpuSkinner } from "./skinning/gpu.js";
export { MotionTable, type Motions } from "./skinning/motions.js";
export type { Skinning as SkinningTable } from "./skinning/skinning.js";
export type { Pose } from "./pose_sender.js";
export type { Probed, ProbeOptions } from "./probe.js";
export type { ConnectionState, ControlState, StateChange } from "./states.js";
export { NO_NORMAL, STRIDE, type Quantisation } from "./decode/packed.js";
export * from "./gen/ecorche/v1/common_pb.js";
export * from "./gen/ecorche/v1/command_pb.js";
export * from "./gen/ecorche/v1/hello_pb.js";
export * from "./gen/ecorche/v1/model_pb.js";
export * from "./gen/ecorche/v1/stream_pb.js";
