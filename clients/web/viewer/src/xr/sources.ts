// SPDX-License-Identifier: Apache-2.0
// Controllers and hands: where they are, what was pressed since the last picture, and how far sticks are pushed.
import * as THREE from "three";

export interface Source {
  readonly input: XRInputSource;
  /** A hand that the headset sees, without a controller. */
  readonly isHand: boolean;
  /** Where it takes hold, m; null while it is not tracked. */
  readonly hold: THREE.Vector3 | null;
  readonly grip: THREE.Matrix4 | null;
  readonly ray: THREE.Ray | null;
}

export type PressKind = "select" | "squeeze";

/** Told with where the source was at that moment. */
export interface Press {
  readonly kind: PressKind;
  readonly down: boolean;
  readonly source: Source;
}

/** Of a stick: to the right and forward, -1 to 1, at rest exactly 0. */
export interface Stick {
  readonly x: number;
  readonly y: number;
}

const DEAD = 0.15;
// Of the standard layout: trigger, squeeze, touchpad, stick, then the lower and the upper button.
export const BUTTON = { stick: 3, lower: 4, upper: 5 } as const;

export class Sources {
  all: readonly Source[] = [];
  #presses: Press[] = [];
  #held = new Map<XRInputSource, readonly boolean[]>();
  #clicks: { source: Source; button: number }[] = [];

  constructor(private readonly session: XRSession, private readonly space: () => XRReferenceSpace | null) {
    const on = (type: "selectstart" | "selectend" | "squeezestart" | "squeezeend", kind: PressKind, down: boolean) =>
      session.addEventListener(type, (event: XRInputSourceEvent) => {
        const base = this.space();
        if (base) this.#presses.push({ kind, down, source: placed(event.inputSource, event.frame, base) });
      });
    on("selectstart", "select", true);
    on("selectend", "select", false);
    on("squeezestart", "squeeze", true);
    on("squeezeend", "squeeze", false);
  }

  update(frame: XRFrame): void {
    const base = this.space();
    if (!base) return;
    this.all = [...this.session.inputSources].map((input) => placed(input, frame, base));
    const held = new Map<XRInputSource, readonly boolean[]>();
    for (const source of this.all) {
      const now = (source.input.gamepad?.buttons ?? []).map((button) => button.pressed);
      const before = this.#held.get(source.input) ?? now;
      now.forEach((pressed, button) => pressed && !before[button] && this.#clicks.push({ source, button }));
      held.set(source.input, now);
    }
    this.#held = held;
  }

  /** Since the last time. */
  takePresses(): readonly Press[] {
    return this.#presses.splice(0);
  }

  takeClicks(): readonly { readonly source: Source; readonly button: number }[] {
    return this.#clicks.splice(0);
  }

  /** All sticks together; where there are none, the touchpads. */
  get stick(): Stick {
    let x = 0, y = 0;
    for (const { input } of this.all) {
      const axes = input.gamepad?.axes ?? [];
      const at = axes.length >= 4 ? 2 : 0;
      x += past(axes[at] ?? 0);
      y -= past(axes[at + 1] ?? 0);
    }
    return { x: THREE.MathUtils.clamp(x, -1, 1), y: THREE.MathUtils.clamp(y, -1, 1) };
  }
}

/** Nothing within the dead zone, and from there on evenly up to 1. */
const past = (value: number): number => Math.sign(value) * Math.max(0, (Math.abs(value) - DEAD) / (1 - DEAD));

function placed(input: XRInputSource, frame: XRFrame, base: XRReferenceSpace): Source {
  const matrix = (space: XRSpace | undefined): THREE.Matrix4 | null => {
    const pose = space && frame.getPose(space, base);
    return pose ? new THREE.Matrix4().fromArray(pose.transform.matrix) : null;
  };
  const grip = matrix(input.gripSpace), aim = matrix(input.targetRaySpace);
  const isHand = Boolean(input.hand);
  return { input, isHand, grip, hold: (input.hand && pinch(input.hand, frame, base)) ?? (grip && origin(grip)), ray: aim && rayOf(aim) };
}

/** Between the tips of thumb and first finger. */
function pinch(hand: XRHand, frame: XRFrame, base: XRReferenceSpace): THREE.Vector3 | null {
  const tips = (["thumb-tip", "index-finger-tip"] as const).map((name) => {
    const joint = hand.get(name);
    const pose = joint && frame.getJointPose?.(joint, base);
    return pose ? new THREE.Vector3(pose.transform.position.x, pose.transform.position.y, pose.transform.position.z) : null;
  });
  return tips[0] && tips[1] ? tips[0].lerp(tips[1], 0.5) : null;
}

const origin = (matrix: THREE.Matrix4): THREE.Vector3 => new THREE.Vector3().setFromMatrixPosition(matrix);
const rayOf = (matrix: THREE.Matrix4): THREE.Ray =>
  new THREE.Ray(origin(matrix), new THREE.Vector3(0, 0, -1).transformDirection(matrix));
