// SPDX-License-Identifier: Apache-2.0
// Numbers of the vertices that the server finds (det F, weights), kept up with the pose: one request on its way, the newest wish after it.
import type { App } from "../app.js";
import { wordsOf } from "../errors.js";
import { valuesOf } from "../rest.js";
import type { Field } from "../../../protocol/src/index.js";

export class VertexValues {
  #busy = false;
  #again = false;
  #have: { key: string; field: Field } | null = null;

  /** `came` is told the least and the most. */
  constructor(private readonly app: App, private readonly came: (least: number, most: number) => void) {}

  /** Shows what the state asks for. */
  show(): void {
    this.#put();
    void this.#follow();
  }

  get #key(): string {
    const { scalar, weightOf, poseSequence, model } = this.app.store.state, identity = this.app.live.client?.model?.identity ?? 0n;
    // Weights are the same in every pose.
    if (scalar === "weight") return model ? `weight ${weightOf} ${identity}` : "";
    return scalar === "det F" ? `det F ${poseSequence} ${identity}` : "";
  }

  async #follow(): Promise<void> {
    this.#again = true;
    if (this.#busy) return;
    this.#busy = true;
    try {
      while (this.#again) {
        this.#again = false;
        const key = this.#key, { client } = this.app.live, { scalar, weightOf } = this.app.store.state;
        if (key === "" || key === this.#have?.key || !client) break;
        const field = await client.field({ of: scalar === "det F" ? "det F" : { segment: weightOf } });
        this.#have = { key, field };
        this.#put();
      }
    } catch (error) {
      if (this.#key !== "") {
        this.app.store.set({ scalar: "none" });
        this.app.say(`The numbers of the surface did not come: ${wordsOf(error)}`);
      }
    } finally {
      this.#busy = false;
    }
  }

  /** Of det F the last pose's stay until the next ones come. */
  #put(): void {
    const { scalar } = this.app.store.state, layout = this.app.live.frame?.layout;
    if (!this.#have || !layout || this.#have.key.split(" ")[0] !== scalar.split(" ")[0]) return;
    if (scalar === "weight" && this.#have.key !== this.#key) return;
    const { body, stage } = this.app, { field } = this.#have;
    if (body.topology?.vertices !== layout.vertexCount) return;
    body.setValues(valuesOf(field.values, layout));
    body.setScalar("values");
    this.came(field.least, field.most);
    stage.invalidate();
  }
}
