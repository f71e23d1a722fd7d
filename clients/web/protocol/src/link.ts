// SPDX-License-Identifier: Apache-2.0
// One connection at a time, on the thread of its decoders: the WebSocket, acknowledgements, pings, and a feed for every stream.
// Knows nothing of poses and sessions: see client.ts. Talks by the messages of channel.ts only.
import { create, fromBinary, toBinary } from "@bufbuild/protobuf";
import type { Post, ToClient, ToLink } from "./channel.js";
import type { MakeKernel } from "./decode/kernel.js";
import { describeFault } from "./errors.js";
import { decodeFrame, encodeFrame, ProtocolError } from "./framing.js";
import { EnvelopeSchema, type Envelope } from "./gen/ecorche/v1/envelope_pb.js";
import type { ModelOpened } from "./gen/ecorche/v1/model_pb.js";
import type { MeshFrame, MeshSelection, Subscribed } from "./gen/ecorche/v1/stream_pb.js";
import { levelLayout, wholeLayout, wholeTissues, type WholeTissue } from "./layout.js";
import { Meter } from "./meter.js";
import { MeshFeed } from "./mesh_feed.js";
import { readSkinning, type Skinning } from "./skinning/skinning.js";

const SUBPROTOCOL = "ecorche.v1";
const SECOND_MS = 1000;
/** Never that of a client, which counts from 2. */
const PING_REQUEST = 1n;

interface Stream {
  subscription: number;
  feed: MeshFeed;
}

export interface LinkOptions {
  makeKernel: MakeKernel;
  /** Threads share memory here. */
  shared: boolean;
}

export class Link {
  private socket: WebSocket | undefined;
  private readonly streams = new Map<number, Stream>();  // by handle
  private readonly asked = new Map<bigint, { handle: number; selection: MeshSelection }>();  // Subscribe under way, by request
  private tissues: WholeTissue[] = [];
  private topology = 0n;
  private segments = 0;
  private readonly meter = new Meter();
  private clock: ReturnType<typeof setInterval> | undefined;

  constructor(private readonly options: LinkOptions, private readonly post: Post<ToClient>) {}

  take(message: ToLink): void {
    switch (message.kind) {
      case "dial": return this.dial(message.url, message.hello);
      case "send": return this.send(message);
      case "return": return this.streams.get(message.stream)?.feed.giveBack(message.level, message.buffer);
      case "forget": return void this.streams.delete(message.stream);
      case "hang up": return this.hangUp(1000, "closed by the client");
    }
  }

  private dial(url: string, hello: Uint8Array): void {
    this.drop();
    let socket: WebSocket;
    try {
      socket = new WebSocket(url, SUBPROTOCOL);
    } catch (error) {
      const why = error instanceof Error ? error.message : String(error);
      return this.post({ kind: "refused", message: `'${url}' is no address of a WebSocket, as ws://127.0.0.1:8080/v1 (${why})` });
    }
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => socket.send(encodeFrame(hello));
    socket.onmessage = (event) => {
      if (socket === this.socket) this.hear(event.data);
    };
    socket.onerror = () => {};  // says nothing of why; "close" follows
    socket.onclose = (event) => {
      if (socket !== this.socket) return;
      this.drop();
      this.post({ kind: "closed", code: event.code, reason: event.reason });
    };
    this.meter.restart();
    this.clock = setInterval(() => this.tick(), SECOND_MS);
  }

  private drop(): void {
    clearInterval(this.clock);
    this.asked.clear();
    const { socket } = this;
    this.socket = undefined;
    socket?.close();
  }

  private hangUp(code: number, reason: string): void {
    if (!this.socket) return;
    this.drop();
    this.post({ kind: "closed", code, reason });
  }

  private send({ envelope, payload, stream }: ToLink & { kind: "send" }): void {
    if (this.socket?.readyState !== WebSocket.OPEN) return;  // the client hears "closed", and refuses what it asked
    if (stream !== undefined) {
      const { requestId, message } = fromBinary(EnvelopeSchema, envelope);
      if (message.case === "subscribe" && message.value.what.case === "mesh") {
        this.asked.set(requestId, { handle: stream, selection: message.value.what.value });
      }
    }
    this.socket.send(encodeFrame(envelope, payload));
  }

  private say(message: Envelope["message"], requestId = 0n): void {
    if (this.socket?.readyState === WebSocket.OPEN) {
      this.socket.send(encodeFrame(toBinary(EnvelopeSchema, create(EnvelopeSchema, { requestId, message }))));
    }
  }

  private hear(data: unknown): void {
    try {
      if (!(data instanceof ArrayBuffer)) throw new ProtocolError("a message of text");
      const { envelope, payload } = decodeFrame(data), parsed = parse(envelope);
      this.meter.received(data.byteLength);
      this.handle(parsed, envelope, payload);
    } catch (error) {
      this.drop();
      if (error instanceof ProtocolError) this.post({ kind: "refused", message: error.message });
      else this.post({ kind: "failed", message: describeFault(error) });
    }
  }

  private handle(parsed: Envelope, envelope: Uint8Array<ArrayBuffer>, payload: Uint8Array<ArrayBuffer>): void {
    const { message, requestId } = parsed;
    switch (message.case) {
      case "meshFrame": return this.show(message.value, payload);
      case "ping": return this.say({ case: "pong", value: { $typeName: "ecorche.v1.Pong", data: message.value.data } }, requestId);
      case "pong": return this.meter.answered();
      case "modelOpened": return this.opened(message.value, envelope, payload);
      case "subscribed": this.subscribed(message.value, requestId, payload); break;
      case "serverHello":
        this.resume(message.value.resumed?.subscriptions ?? []);
        break;
      case "volumeFrame":
        this.acknowledge(message.value.subscription, message.value.frame);
        break;
      default:
    }
    this.pass(envelope, payload);
  }

  /** Hands a message on; its bytes are given away where they are all that the buffer holds. */
  private pass(envelope: Uint8Array<ArrayBuffer>, payload: Uint8Array<ArrayBuffer>): void {
    this.post({ kind: "message", envelope, payload }, [envelope.buffer]);
  }

  /** The triangles stay here, where layouts are made. */
  private opened(model: ModelOpened, envelope: Uint8Array<ArrayBuffer>, payload: Uint8Array<ArrayBuffer>): void {
    this.streams.clear();  // subscriptions end with that
    this.tissues = wholeTissues(model, payload);
    this.topology = model.topologyDigest;
    this.segments = model.skeleton?.segments.length ?? 0;
    this.post({ kind: "message", envelope: envelope.slice(), payload: new Uint8Array() });
  }

  private subscribed(answer: Subscribed, requestId: bigint, payload: Uint8Array<ArrayBuffer>): void {
    const asked = this.asked.get(requestId);
    if (!asked) return;
    this.asked.delete(requestId);
    const { handle, selection } = asked;
    const layouts = answer.levels.map((level) => levelLayout(level, payload, this.tissues));
    if (!layouts.some((layout) => layout.level === selection.level)) layouts.unshift(wholeLayout(this.tissues, selection.tissues));
    const { topology, options: { makeKernel, shared } } = this;
    let skinning: Skinning | undefined;
    if (selection.motions) {
      if (!answer.skinning) throw new ProtocolError("motions without what to skin by");
      skinning = readSkinning(answer.skinning, payload, layouts[0], this.segments);
    }
    const feed = new MeshFeed({ stream: handle, layouts, topology, encoding: selection.encoding, makeKernel, shared, skinning }, this.post);
    this.streams.set(handle, { subscription: answer.subscription, feed });
    this.post({ kind: "layouts", stream: handle, layouts, ...(skinning && { skinning }) });
  }

  /** Streams that the server still has go on by their new numbers; the others are subscribed to anew. */
  private resume(subscriptions: { was: number; is: number }[]): void {
    for (const [handle, stream] of this.streams) {
      const now = subscriptions.find(({ was }) => was === stream.subscription);
      if (now) stream.subscription = now.is;
      else this.streams.delete(handle);
    }
  }

  private acknowledge(subscription: number, frame: bigint): void {
    this.say({ case: "frameAck", value: { $typeName: "ecorche.v1.FrameAck", subscription, frame } });
  }

  private show(frame: MeshFrame, payload: Uint8Array<ArrayBuffer>): void {
    this.acknowledge(frame.subscription, frame.frame);
    for (const { subscription, feed } of this.streams.values()) {
      if (subscription === frame.subscription) this.meter.decoded(feed.show(frame, payload));
    }
  }

  private tick(): void {
    const data = this.meter.ask();
    if (data) this.say({ case: "ping", value: { $typeName: "ecorche.v1.Ping", data } }, PING_REQUEST);
    this.post({ kind: "statistics", statistics: this.meter.second() });
  }
}

function parse(envelope: Uint8Array): Envelope {
  try {
    return fromBinary(EnvelopeSchema, envelope);
  } catch (error) {
    throw new ProtocolError(`an envelope cannot be read: ${error}`);
  }
}
