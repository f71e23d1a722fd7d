// SPDX-License-Identifier: Apache-2.0
// What a client tells, and what it is told: the types about client.ts.
import type { MessageInitShape } from "@bufbuild/protobuf";
import type { Statistics } from "./channel.js";
import type { ClipState, IkTargetSchema, Members } from "./gen/ecorche/v1/command_pb.js";
import type { PoseState } from "./gen/ecorche/v1/common_pb.js";
import type { ModelOpened } from "./gen/ecorche/v1/model_pb.js";
import type { PoseAck, VolumeFrame } from "./gen/ecorche/v1/stream_pb.js";
import type { BodyFrame } from "./mesh_stream.js";
import type { ControlState, StateChange } from "./states.js";

export interface ClientEvents {
  frame: BodyFrame;
  /** A pose of this session was taken up or refused: clamped joints, skipped poses. */
  pose: PoseAck;
  control: ControlState;
  /** The pose that the session shows, where this client did not set it: of a newcomer, an observer, a clip. */
  shown: PoseState;
  /** Who is in the session. */
  members: Members;
  /** What the server plays. */
  clip: ClipState;
  state: StateChange;
  statistics: Statistics;
  /** The model was read anew: open() again for it. */
  modelChanged: { identity: bigint };
  /** The model is open anew, after a loss that the server did not remember, or after open(). */
  opened: ModelOpened;
  volume: { frame: VolumeFrame; payload: Uint8Array };
}

export interface ClientOptions {
  token?: string;
  /** For the server's log. */
  name?: string;
  /** What others in the session call who uses this client. */
  person?: string;
  /** That will be opened, where a balancer stands in front of several servers: it chooses one by it. Goes into the address, too. */
  session?: string;
  onState?: (change: StateChange) => void;
  /** The bundle of worker.ts, which receives and decodes; false: this thread does. None: as the page was bundled. */
  worker?: string | URL | false;
}

export type IkTargetInit = MessageInitShape<typeof IkTargetSchema>;
