// SPDX-License-Identifier: Apache-2.0
// The client: connects, comes back by itself, asks, and hands out what the server tells. Frames are decoded by a link (link.ts).
//
//     const client = await Client.connect("ws://127.0.0.1:8080/v1");
//     const { skeleton } = await client.open("patient");
//     const stream = await client.subscribeMesh({ tissues: ["skin"] });
//     stream.on("frame", ({ vertices, scale, offset }) => ...);
//     client.setPose({ rotation });
import { create, fromBinary } from "@bufbuild/protobuf";
import { makeBridge, type Bridge } from "./bridge.js";
import type { FrameNote, Post, ToClient, ToLink } from "./channel.js";
import type { ClientEvents, ClientOptions, IkTargetInit } from "./client_events.js";
import { Emitter } from "./emitter.js";
import { Code, ConnectionError, ofKnownProtocol, report, ServerError } from "./errors.js";
import { Encoding, type PoseState } from "./gen/ecorche/v1/common_pb.js";
import type { ClipSummary, ControlGranted, IkSolved } from "./gen/ecorche/v1/command_pb.js";
import { AskControlSchema, GiveControlSchema, PlayClipSchema, SolveIkSchema, SteerClipSchema } from "./gen/ecorche/v1/command_pb.js";
import { EnvelopeSchema, type Envelope } from "./gen/ecorche/v1/envelope_pb.js";
import { ClientHelloSchema, Feature, type ServerHello } from "./gen/ecorche/v1/hello_pb.js";
import { OpenModelSchema, Role, type ModelOpened, type ModelSummary } from "./gen/ecorche/v1/model_pb.js";
import { SubscribeSchema } from "./gen/ecorche/v1/stream_pb.js";
import type { IkOptions } from "./ik.js";
import { encodeField, encodeRadiograph, readField, readRadiograph, type Field, type FieldOptions, type Radiograph, type RadiographOptions } from "./inspect.js";
import { MeshStream, type MeshOptions } from "./mesh_stream.js";
import { PoseSender, type Pose } from "./pose_sender.js";
import { encodeProbe, readProbe, type ProbeOptions, type Probed } from "./probe.js";
import { Redial } from "./redial.js";
import { encode, Requests, type Answer, type Case, type Message } from "./requests.js";
import { encodeHang, readSpheres, type Spheres } from "./spheres.js";
import type { ControlState, StateChange } from "./states.js";
import { compilesWebAssembly } from "./webassembly.js";

/** None of these mends itself by dialling again. */
const FINAL: number[] = [Code.UNAUTHENTICATED, Code.FAILED_PRECONDITION, Code.INVALID_ARGUMENT];

export class Client extends Emitter<ClientEvents> {
  hello!: ServerHello;
  /** What open() told. */
  model: ModelOpened | undefined;
  control: ControlState = { role: Role.UNSPECIFIED, vacant: false, reservedSeconds: 0 };
  state: StateChange = { state: "connecting", reason: "" };

  private readonly bridge: Bridge;
  private readonly post: Post<ToLink>;
  private readonly requests = new Requests();
  private readonly poses = new PoseSender((message) => this.tell(message));
  private readonly streams = new Map<number, MeshStream>();
  private nextHandle = 1;
  private ending: Error | undefined;  // why the server ends the connection, told before it does
  private readonly redial = new Redial({
    restore: () => this.restore(),
    waits: (reason, retryMs) => this.change({ state: "reconnecting", reason, retryMs }),
    isFinal: (error) => error instanceof ServerError && FINAL.includes(error.code),
    givesUp: (reason) => this.close(reason),
  });

  private constructor(private readonly url: string, private readonly options: ClientOptions) {
    super();
    this.bridge = makeBridge(options.worker, (message) => this.hear(message));
    this.post = this.bridge.post;
  }

  /** Rejects where the first connection fails; later losses are healed, as "state" tells. */
  static async connect(url: string, options: ClientOptions = {}): Promise<Client> {
    const client = new Client(url, options);
    if (options.onState) client.on("state", options.onState);
    try {
      client.change({ state: "connecting", reason: "" });
      client.hello = await client.dial();
    } catch (error) {
      client.close(error instanceof Error ? error.message : String(error));
      throw error;
    }
    client.change({ state: "open", reason: "" });
    return client;
  }

  close(reason = "closed"): void {
    if (this.state.state === "closed") return;
    this.redial.stop();
    this.change({ state: "closed", reason });
    this.tell({ case: "goodbye", value: { $typeName: "ecorche.v1.Goodbye", retrySeconds: 0, elsewhere: "" } });
    this.post({ kind: "hang up" });
    this.bridge.end();
    this.requests.fail(new ConnectionError(reason));
  }

  async listModels(): Promise<ModelSummary[]> {
    return (await this.ask({ case: "listModels", value: { $typeName: "ecorche.v1.ListModels" } }, "modelList")).value.models;
  }

  /** No `model`: the server's first. No `session`: one of its own. Streams that there are go on with the new body. */
  async open(model = "", session = ""): Promise<ModelOpened> {
    const streams = [...this.streams.values()];  // not those that are asked for while the answer is on its way
    const { value } = await this.ask({ case: "openModel", value: create(OpenModelSchema, { model, session, packedTriangles: compilesWebAssembly() }) }, "modelOpened");
    this.model = value;
    this.poses.restart(value.lastSequence);
    this.setControl({ role: value.role, vacant: false, reservedSeconds: 0 });
    this.emit("opened", value);
    this.tellShown(value.pose);
    for (const stream of streams) await this.subscribe(stream);
    return value;
  }

  async subscribeMesh(options: MeshOptions = {}): Promise<MeshStream> {
    const handle = this.nextHandle++;
    const stream = new MeshStream(handle, options, (level, buffer) => this.post({ kind: "return", stream: handle, level, buffer }, [buffer]));
    this.streams.set(handle, stream);
    try {
      await this.subscribe(stream);
    } catch (error) {
      this.streams.delete(handle);
      throw error;
    }
    return stream;
  }

  /** Another choice for the same stream; the old one's frames go on until the new one's come. */
  async changeMesh(stream: MeshStream, options: MeshOptions): Promise<void> {
    const was = stream.subscription, before = stream.options;
    stream.options = options;
    try {
      await this.subscribe(stream);
    } catch (error) {
      stream.options = before;
      throw error;
    }
    if (was !== stream.subscription) await this.unsubscribe(was);
  }

  async closeMesh(stream: MeshStream): Promise<void> {
    this.streams.delete(stream.handle);
    this.post({ kind: "forget", stream: stream.handle });
    await this.unsubscribe(stream.subscription);
  }

  /** Shows a pose: the newest wins, none waits behind another. What came of it: the event "pose". */
  setPose(pose: Pose): void {
    if (!this.model) throw new Error("no model is open (open() one before setPose())");
    const joints = this.model.skeleton?.segments.length ?? 0;
    if (pose.rotation.length !== 4 * joints) throw new Error(`a pose of ${pose.rotation.length} numbers, expected 4 for each of ${joints} joints`);
    this.poses.set(pose, this.model.rigDigest);
  }

  /** The last pose that was set here. */
  get pose(): Pose | undefined {
    return this.poses.newest;
  }

  async solveIk(targets: IkTargetInit[], { from, apply, moveRoot }: IkOptions = {}): Promise<IkSolved> {
    const applyAs = apply ? this.poses.take() : 0n;
    const value = create(SolveIkSchema, { targets, rotation: from ? Array.from(from) : [], applyAs, moveRoot: moveRoot ?? false });
    return (await this.ask({ case: "solveIk", value }, "ikSolved")).value;
  }

  async claimControl(): Promise<void> {
    const { value } = await this.ask({ case: "claimControl", value: { $typeName: "ecorche.v1.ClaimControl" } }, "controlGranted");
    this.granted(value);
  }

  /** Asks whoever holds control for it, too. True where it was granted at once; else "control" tells when it is. */
  async askControl(): Promise<boolean> {
    try {
      this.granted((await this.ask({ case: "askControl", value: create(AskControlSchema) }, "controlGranted")).value);
      return true;
    } catch (error) {
      // An OK in place of the control: its holder has been told.
      if (error instanceof ServerError && error.code === 0) return false;
      throw error;
    }
  }

  /** Asks no more. */
  async withdrawAsk(): Promise<void> {
    await this.ask({ case: "askControl", value: create(AskControlSchema, { withdraw: true }) }, "status");
  }

  /** Gives control to another connection of the session: SessionMember.connection. */
  async giveControl(connection: bigint): Promise<void> {
    await this.ask({ case: "giveControl", value: create(GiveControlSchema, { connection }) }, "status");
  }

  async releaseControl(): Promise<void> {
    await this.ask({ case: "releaseControl", value: { $typeName: "ecorche.v1.ReleaseControl" } }, "status");
    this.setControl({ role: Role.OBSERVER, vacant: true, reservedSeconds: 0 });
  }

  async listClips(): Promise<ClipSummary[]> {
    return (await this.ask({ case: "listClips", value: { $typeName: "ecorche.v1.ListClips" } }, "clipList")).value.clips;
  }

  /** No name: stop. `position`: in seconds of the clip; `paused`: only the pose there is shown. */
  async playClip(name: string, options: { speed?: number; loop?: boolean; position?: number; paused?: boolean } = {}): Promise<void> {
    await this.ask({ case: "playClip", value: create(PlayClipSchema, { name, speed: 1, ...options }) }, "status");
  }

  /** The clip that plays or is paused; what is left out stays. `step`: so many poses on, or back. */
  async steerClip(change: { paused?: boolean; position?: number; step?: number; speed?: number; loop?: boolean }): Promise<void> {
    await this.ask({ case: "steerClip", value: create(SteerClipSchema, change) }, "status");
  }

  /** Begins a recording on the server under this name; none: ends it, once its file is whole. */
  async record(name?: string): Promise<void> {
    await this.ask({ case: "record", value: { $typeName: "ecorche.v1.Record", on: name !== undefined, name: name ?? "" } }, "status");
  }

  /** `points`: 3 numbers each, mm, LPS. */
  async probe(points: ArrayLike<number>, options: ProbeOptions = {}): Promise<Probed> {
    const { message, payload } = encodeProbe(points, options);
    const answer = await this.ask(message, "probed", payload);
    return readProbe(answer.value, answer.payload);
  }

  /** A picture of the present pose as an X-ray source and a detector would make it. One at a time. */
  async radiograph(options: RadiographOptions = {}): Promise<Radiograph> {
    const { value, payload } = await this.ask(encodeRadiograph(options), "radiograph");
    return readRadiograph(value, options.content ?? 0, payload);
  }

  /** A number for every vertex of tissues in the present pose. One at a time. */
  async field(options: FieldOptions): Promise<Field> {
    const { value, payload } = await this.ask(encodeField(options), "field");
    return readField(value, payload);
  }

  /** The balls that pose a volume by spheres, as they hang in this session. */
  async spheres(volume: string): Promise<Spheres> {
    const { value, payload } = await this.ask({ case: "getSpheres", value: { $typeName: "ecorche.v1.GetSpheres", volume } }, "spheres");
    return readSpheres(value, payload as Uint8Array<ArrayBuffer>, this.model?.skeleton?.segments.length ?? 0);
  }

  /** Hangs them otherwise, or about other joints, in this session; null: as the model has it. */
  async hangSpheres(volume: string, segment: Int32Array | null, joints: Float64Array | null): Promise<void> {
    const { message, payload } = encodeHang(volume, segment, joints);
    await this.ask(message, "status", payload);
  }

  /** Any other request of the protocol. `stream`: of a Subscribe whose frames are for it. */
  ask<C extends Case>(message: Message, expected: C, payload?: Uint8Array, stream?: number): Promise<Answer<C>> {
    if (this.state.state !== "open" && message.case !== "clientHello" && !this.restoring) {
      return Promise.reject(new ConnectionError(`not connected: ${this.state.reason || this.state.state}`));
    }
    const { envelope, answer } = this.requests.ask(message, expected);
    this.post({ kind: "send", envelope, ...(payload && { payload }), ...(stream !== undefined && { stream }) });
    return answer;
  }
  private restoring = false;

  private tell(message: Message): boolean {
    if (this.state.state !== "open" && message.case !== "goodbye") return false;
    this.post({ kind: "send", envelope: encode(message) });
    return true;
  }

  private async subscribe(stream: MeshStream): Promise<void> {
    const { tissues = [], level = 0, adaptive = false, encoding = Encoding.U16_DELTA, normals = false, quality = false, maxRate = 0, motions = false } = stream.options;
    const value = create(SubscribeSchema, {
      what: {
        case: "mesh",
        value: motions ? { tissues, level, quality, motions, pose: true, encoding: Encoding.F32 } : { tissues, level, adaptive, encoding, normals, quality, pose: true },
      },
      maxRate,
    });
    const answer = await this.ask({ case: "subscribe", value }, "subscribed", undefined, stream.handle);
    stream.subscription = answer.value.subscription;
  }

  /** Streams of equal choices share a number; the last one ends it. */
  private async unsubscribe(subscription: number): Promise<void> {
    if ([...this.streams.values()].some((stream) => stream.subscription === subscription)) return;
    await this.ask({ case: "unsubscribe", value: { $typeName: "ecorche.v1.Unsubscribe", subscription } }, "status");
  }

  private async dial(): Promise<ServerHello> {
    const { token, name = "ecorche web", person = "", session = "" } = this.options;
    const hello = create(ClientHelloSchema, {
      protocolMin: 1, protocolMax: 1, client: name, name: person,
      features: [Feature.POSE, Feature.CLIP_STATE, Feature.PRESENCE],
      encodings: [Encoding.F32, Encoding.U16, Encoding.U16_DELTA],
      token: new TextEncoder().encode(token ?? ""),
      resumeToken: this.hello?.resumeToken ?? new Uint8Array(),
      session,
    });
    this.ending = undefined;
    const { envelope, answer } = this.requests.ask({ case: "clientHello", value: hello }, "serverHello");
    this.post({ kind: "dial", url: this.url + (session && `?session=${encodeURIComponent(session)}`), hello: envelope });
    return ofKnownProtocol((await answer).value);
  }

  private hear(message: ToClient): void {
    switch (message.kind) {
      case "message": return this.handle(fromBinary(EnvelopeSchema, message.envelope), message.payload);
      case "frame": return this.show(message);
      case "layouts": return this.streams.get(message.stream)?.arrange(message.layouts, message.skinning);
      case "statistics": return this.emit("statistics", message.statistics);
      case "closed": return this.lost(this.ending ?? new ConnectionError(message.reason || `the connection ended (${message.code})`));
      case "refused": return this.lost(new ConnectionError(message.message));
      case "slots": return this.streams.get(message.stream)?.share(message.level, message.slots, message.control);
      case "failed": return this.fail(message.message);
    }
  }

  private handle(envelope: Envelope, payload: Uint8Array): void {
    if (this.requests.answer(envelope, payload)) return;
    const { message } = envelope;
    switch (message.case) {
      case "poseAck":
        if (this.model) this.poses.acknowledged(message.value.sequence, this.model.rigDigest);
        return this.emit("pose", message.value);
      case "controlChanged": {
        const { role, vacant, reservedSeconds } = message.value;
        return this.setControl({ role, vacant, reservedSeconds });
      }
      case "controlGranted": return this.granted(message.value);
      case "members": return this.emit("members", message.value);
      case "clipState": return this.emit("clip", message.value);
      case "modelChanged": return this.emit("modelChanged", { identity: message.value.identity });
      case "volumeFrame": return this.emit("volume", { frame: message.value, payload });
      case "goodbye":
        this.redial.retrySeconds = message.value.retrySeconds;
        this.ending = new ConnectionError(message.value.status?.message || "the server stops");
        return;
      case "status":
        this.ending = new ServerError(message.value);
        return;
      default:  // newer servers say more
    }
  }

  private show(note: FrameNote): void {
    const { message } = fromBinary(EnvelopeSchema, note.envelope);
    const frame = message.case === "meshFrame" ? this.streams.get(note.stream)?.show(note, message.value) : undefined;
    if (!frame) return;
    if (message.case === "meshFrame") this.tellShown(message.value.pose);
    this.emit("frame", frame);
  }

  private tellShown(pose: PoseState | undefined): void {
    if (pose && (this.poses.own === 0n || pose.sequence > this.poses.own)) this.emit("shown", pose);
  }

  private granted({ lastSequence, pose }: ControlGranted): void {
    this.poses.restart(lastSequence);
    this.setControl({ role: Role.CONTROLLER, vacant: false, reservedSeconds: 0 });
    this.tellShown(pose);
  }

  /** A fault of our own: never healed in silence. */
  private fail(message: string): void {
    this.close(message);
    report(new Error(message));
  }

  private lost(error: Error): void {
    this.requests.fail(error);
    if (this.state.state === "open") this.redial.after(error);
  }

  /** The place again where the server remembers it, else the same model and session anew. */
  private async restore(): Promise<void> {
    this.hello = await this.dial();
    const { resumed } = this.hello;
    this.restoring = true;
    try {
      if (resumed) {
        this.poses.restart(resumed.lastSequence);
        this.setControl({ role: resumed.role, vacant: false, reservedSeconds: 0 });
        // Who poses knows better: what the line swallowed goes again.
        if (resumed.role !== Role.CONTROLLER) this.tellShown(resumed.pose);
        await this.subscribeMissing(resumed.subscriptions);
      } else if (this.model) {
        await this.open(this.model.model, this.model.session);
      }
    } finally {
      this.restoring = false;
    }
    this.change({ state: "open", reason: "" });
    if (this.model && this.control.role === Role.CONTROLLER) this.poses.recover(this.model.rigDigest);
  }

  private async subscribeMissing(kept: { was: number; is: number }[]): Promise<void> {
    for (const stream of this.streams.values()) {
      const now = kept.find(({ was }) => was === stream.subscription);
      if (now) stream.subscription = now.is;
      else await this.subscribe(stream);
    }
  }

  private setControl(control: ControlState): void {
    this.control = control;
    this.emit("control", control);
  }

  private change(change: StateChange): void {
    this.state = change;
    this.emit("state", change);
  }
}


