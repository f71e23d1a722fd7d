// SPDX-License-Identifier: Apache-2.0
// The line to the server: connects, opens the model that the address names, and puts what comes into the state and the scene.
import { Client, Code, ConnectionError, Role, ServerError, type BodyFrame, type MeshLayout, type MeshStream, type ModelOpened } from "../../protocol/src/index.js";
import { Arrival } from "./arrival.js";
import { hashParameters, takeToken } from "./hash.js";
import { capsOf, restNumbers } from "./rest.js";
import type { Body, Positions } from "./scene/body.js";
import type { AppState, Model } from "./state/app_state.js";
import type { History } from "./state/history.js";
import { labelOf } from "./state/names.js";
import { qualityOf } from "./state/quality.js";
import type { Store } from "./state/store.js";
import { wordsOf } from "./errors.js";

const RETRY_MS = 2000;
/** Whoever opens the server's address comes into the same session, and sees the same body. */
const SHARED_SESSION = "shared";

type WholeBody = Pick<BodyFrame, "vertices" | "layout" | "offset" | "scale">;

export interface Opened {
  readonly client: Client;
  readonly model: ModelOpened;
}

export class Live {
  client: Client | null = null;
  stream: MeshStream | null = null;
  /** What is drawn. */
  frame: BodyFrame | null = null;
  #listeners = { opened: new Set<(opened: Opened) => void>(), body: new Set<(first: boolean) => void>(), topology: new Set<() => void>() };
  #layout: MeshLayout | null = null;
  #token: string | undefined;
  #topology = 0n;
  #whole: Promise<WholeBody> | null = null;

  constructor(
    private readonly store: Store<AppState>, private readonly history: History, private readonly body: Body, readonly arrival: Arrival,
  ) {}

  /** A model is open: at first, after the server forgot this client, and after the model was read again. At once, too, where one is. */
  onOpened(listener: (opened: Opened) => void): () => void {
    this.#listeners.opened.add(listener);
    if (this.client?.model) listener({ client: this.client, model: this.client.model });
    return () => this.#listeners.opened.delete(listener);
  }

  /** The body has another pose; `first`: of a model. */
  onBody(listener: (first: boolean) => void): () => void {
    this.#listeners.body.add(listener);
    return () => this.#listeners.body.delete(listener);
  }

  /** The scene has other meshes: of another model or level of detail. */
  onTopology(listener: () => void): () => void {
    this.#listeners.topology.add(listener);
    return () => this.#listeners.topology.delete(listener);
  }

  /** Tries until there is a body, or until only a person can help (store.link says how). */
  async start(): Promise<void> {
    this.#token = takeToken();
    // Who leaves says so: else control of the session is kept for them for a minute. What comes back out of the browser's own cache
    // has said it already.
    addEventListener("pagehide", () => this.client?.close());
    addEventListener("pageshow", ({ persisted }) => persisted && location.reload());
    for (;;) {
      try {
        await this.#connect();
        return;
      } catch (error) {
        this.client?.close();
        this.client = null;
        this.store.set({ link: { state: "closed", reason: reasonOf(error), mends: error instanceof ConnectionError } });
        if (!(error instanceof ConnectionError)) return;
        await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
      }
    }
  }

  /** The scanned body in the order of the present vertices. */
  async rest(): Promise<Positions> {
    const whole = await (this.#whole ??= this.#fetchRest());
    const layout = this.#layout;
    if (!layout) throw new ConnectionError("no model is open");
    return { numbers: restNumbers(whole, layout), low: whole.offset, step: whole.scale };
  }

  /** The first frame of a session of its own, which ends with that; kept for the model's other levels of detail. */
  async #fetchRest(): Promise<WholeBody> {
    if (!this.client?.model) throw new ConnectionError("no model is open");
    const client = await Client.connect(address(), { token: this.#token, name: "ecorche viewer, rest" });
    try {
      await client.open(this.client.model.model);
      const stream = await client.subscribeMesh();
      const frame = stream.latest ?? await new Promise<BodyFrame>((resolve, reject) => {
        stream.on("frame", resolve);
        client.on("state", ({ state, reason }) => state !== "open" && reject(new ConnectionError(reason)));
      });
      return { vertices: frame.vertices.slice(), layout: frame.layout, offset: frame.offset, scale: frame.scale };
    } catch (error) {
      this.#whole = null;
      throw error;
    } finally {
      client.close();
    }
  }

  async #connect(): Promise<void> {
    const asked = hashParameters(), session = asked.get("session") ?? SHARED_SESSION;
    const client = await Client.connect(address(), {
      session, token: this.#token, name: "ecorche viewer", person: localStorage.getItem("ecorche.name") ?? "",
      onState: ({ state, reason, retryMs }) => {
        if (state !== "closed" || this.client) this.store.set({ link: { state, reason, mends: state !== "closed", ...(retryMs === undefined ? {} : { retryAt: Date.now() + retryMs }) } });
      },
    });
    this.client = client;
    client.on("statistics", ({ framesPerSecond, bytesPerSecond, latencyMs }) => {
      this.store.set({ stats: { framesPerSecond, bytesPerSecond, latencyMs, level: this.frame?.level ?? 0, way: this.frame?.skinned ? "skinning" : "frames" } });
    });
    client.on("control", ({ role }) => this.#patchModel({ controls: role === Role.CONTROLLER }));
    client.on("opened", (model) => this.#opened(client, model));
    client.on("modelChanged", () => void client.open(client.model?.model, client.model?.session).catch((error: unknown) => {
      this.store.set({ link: { state: "closed", reason: reasonOf(error), mends: false } });
    }));
    performance.mark("ecorche connected");
    // No name: its first model.
    const model = await client.open(asked.get("model") ?? "", session);
    performance.mark("ecorche opened");
    const stream = await client.subscribeMesh(Arrival.firstOf(model));
    this.stream = stream;
    stream.on("frame", this.arrival.paced((frame) => this.#show(frame)));
    if (stream.latest) this.#show(stream.latest);
    this.arrival.follow(client, stream);
  }

  #opened(client: Client, opened: ModelOpened): void {
    const model: Model = {
      name: opened.model, session: opened.session, controls: opened.role === Role.CONTROLLER,
      tissues: opened.tissues.map((tissue, row) => ({
        row, name: tissue.name, label: labelOf(tissue.name), group: tissue.group, segment: tissue.segment, vertices: Number(tissue.vertices),
        capped: tissue.capVertices.length > 0,
      })),
      joints: opened.skeleton?.segments.map((segment) => segment.joint?.name || segment.name) ?? [],
      segments: opened.skeleton?.segments.map(({ name }) => name) ?? [],
    };
    if (opened.topologyDigest === this.#topology) {
      this.store.set({ model });
    } else {
      this.#topology = opened.topologyDigest;
      this.#layout = null;
      this.#whole = null;
      this.frame = null;
      this.history.clear();
      const layers = model.tissues.map(() => ({ visible: true, opacity: 1 }));
      this.store.set({ model, layers, isolated: null, selected: null, hovered: null, scalar: "none", weightOf: 0, quality: null });
    }
    for (const listener of [...this.#listeners.opened]) listener({ client, model: opened });
  }

  #show(frame: BodyFrame): void {
    const first = this.frame === null;
    if (first) performance.mark("ecorche frame");
    this.frame = frame;
    const changed = frame.layout !== this.#layout;
    if (changed) {
      this.#layout = frame.layout;
      const { vertexCount, indices, ranges } = frame.layout;
      this.body.setTopology({
        vertices: vertexCount, indices,
        ranges: ranges.map(({ tissue, firstVertex, vertexCount: count, firstIndex, indexCount }) => ({ row: tissue, firstVertex, vertexCount: count, firstIndex, indexCount })),
        caps: capsOf(this.client?.model?.tissues ?? [], frame.layout),
      });
    }
    this.body.setPositions(this.arrival.positionsOf(frame));
    if (changed) for (const listener of [...this.#listeners.topology]) listener();
    const quality = frame.quality ? qualityOf(frame.quality, this.store.state.model) : this.store.state.quality;
    if (quality !== this.store.state.quality || frame.poseSequence !== this.store.state.poseSequence) {
      this.store.set({ quality, poseSequence: frame.poseSequence });
    }
    for (const listener of [...this.#listeners.body]) listener(first);
  }

  #patchModel(patch: Partial<Model>): void {
    const { model } = this.store.state;
    if (model) this.store.set({ model: { ...model, ...patch } });
  }
}

function address(): string {
  return `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/v1`;
}

/** In plain words, with what to do. */
function reasonOf(error: unknown): string {
  if (error instanceof ServerError && error.code === Code.UNAUTHENTICATED) {
    return "The server wants another token. Open the whole address that `ecorche serve` printed, with all that follows its #.";
  }
  if (error instanceof ConnectionError) return "The server does not answer. Is `ecorche serve` running, and is this page's address its own?";
  return wordsOf(error);
}
