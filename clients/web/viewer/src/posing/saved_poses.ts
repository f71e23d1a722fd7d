// SPDX-License-Identifier: Apache-2.0
// A person's own poses, kept by the browser: each as the text of a pose.yaml, with a small picture.

export interface SavedPose {
  readonly name: string;
  readonly yaml: string;
  /** A JPEG in base64. */
  readonly picture: string;
}

const KEY = "ecorche.poses";

function isSaved(value: unknown): value is SavedPose {
  const saved = value as SavedPose | null;
  return typeof saved === "object" && saved !== null && [saved.name, saved.yaml, saved.picture].every((text) => typeof text === "string");
}

export class SavedPoses {
  readonly #key: string;

  /** Poses of one skeleton: others mean nothing on it. */
  constructor(skeleton: string, private readonly storage: Pick<Storage, "getItem" | "setItem">) {
    this.#key = `${KEY}.${skeleton}`;
  }

  /** What is not as it should be, since somebody else wrote it, is left out. */
  list(): readonly SavedPose[] {
    try {
      const all: unknown = JSON.parse(this.storage.getItem(this.#key) ?? "[]");
      return Array.isArray(all) ? all.filter(isSaved) : [];
    } catch {
      return [];
    }
  }

  /** Takes the place of one of that name. Throws where the browser has no room. */
  save(pose: SavedPose): void {
    this.#write([...this.list().filter(({ name }) => name !== pose.name), pose]);
  }

  remove(name: string): void {
    this.#write(this.list().filter((pose) => pose.name !== name));
  }

  /** `Pose 1`, `Pose 2`, ...: the first that is free. */
  freeName(): string {
    const taken = new Set(this.list().map(({ name }) => name));
    for (let i = 1; ; i++) if (!taken.has(`Pose ${i}`)) return `Pose ${i}`;
  }

  #write(poses: readonly SavedPose[]): void {
    try {
      this.storage.setItem(this.#key, JSON.stringify(poses));
    } catch {
      throw new Error("the browser has no room for more poses: delete some, or download this one");
    }
  }
}
