// SPDX-License-Identifier: Apache-2.0
// The renderer, the camera and what stands in the scene. Metres, y up; `patient` takes children in the patient's LPS millimetres.
// A picture is drawn when something asked for one, and at no other time.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { backdrop, ground } from "./ground.js";

export interface Surroundings {
  readonly above: number;
  readonly below: number;
  readonly shadow: number;
  /** Of selections. */
  readonly accent: number;
}

export interface Insets {
  readonly left: number;
  readonly right: number;
  readonly top: number;
  readonly bottom: number;
}

/** What a headset gives in place of the page's clock and camera. */
export interface Immersion {
  readonly camera: THREE.PerspectiveCamera;
  /** Null where the room itself is seen behind the scene. */
  readonly background: THREE.Color | null;
  /** Before every picture. */
  frame(seconds: number, frame: XRFrame): void;
}

export class Stage {
  readonly renderer: THREE.WebGLRenderer;
  readonly scene = new THREE.Scene();
  readonly camera = new THREE.PerspectiveCamera(30, 1, 0.05, 60);
  readonly controls: OrbitControls;
  /** LPS in mm: x to the patient's left, y to the back, z to the head. */
  readonly patient = new THREE.Group();
  readonly #backdrop = backdrop();
  readonly #ground = ground();
  #wanted = 0;
  #before = new Set<(seconds: number) => void>();
  #after = new Set<() => void>();
  #resized = new Set<() => void>();
  #last = 0;
  #panels: Insets = { left: 0, right: 0, top: 0, bottom: 0 };
  #more: Insets | null = null;
  #surroundings: Surroundings = { above: 0, below: 0, shadow: 0, accent: 0 };
  #immersed = false;
  #grounded = false;

  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, stencil: true, powerPreference: "high-performance" });
    this.renderer.toneMapping = THREE.ACESFilmicToneMapping;
    this.renderer.toneMappingExposure = 1;
    this.renderer.info.autoReset = true;
    this.renderer.localClippingEnabled = true;
    // The front of the patient looks along +z, his head along +y.
    this.patient.matrixAutoUpdate = false;
    this.patient.matrix.makeRotationX(-Math.PI / 2).scale(new THREE.Vector3(0.001, 0.001, 0.001));
    this.patient.matrixWorldNeedsUpdate = true;
    this.scene.add(this.#backdrop.mesh, this.#ground.mesh, this.patient);
    this.camera.position.set(0.6, 0.3, 4);
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, {
      enableDamping: !matchMedia("(prefers-reduced-motion: reduce)").matches, dampingFactor: 0.12,
      minDistance: 0.08, maxDistance: 20, zoomToCursor: true, zoomSpeed: 1.2, rotateSpeed: 0.9,
    });
    this.controls.addEventListener("change", () => this.invalidate());
    document.addEventListener("visibilitychange", () => this.invalidate());
    canvas.addEventListener("webglcontextrestored", () => this.invalidate());
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement!);
    this.resize();
  }

  /** Draws a picture at the next turn of the screen. */
  invalidate(): void {
    if (this.#wanted || this.#immersed || document.hidden) return;
    this.#wanted = requestAnimationFrame((time) => this.#draw(time));
  }

  /** Called before every picture, with the seconds since the last one (at most 0.1). */
  onBeforeDraw(listener: (seconds: number) => void): () => void {
    this.#before.add(listener);
    return () => this.#before.delete(listener);
  }

  /** Called after every picture. */
  onAfterDraw(listener: () => void): () => void {
    this.#after.add(listener);
    return () => this.#after.delete(listener);
  }

  /** Called after the picture, or what panels leave of it, has another size. */
  onResize(listener: () => void): () => void {
    this.#resized.add(listener);
    return () => this.#resized.delete(listener);
  }

  surround(colors: Surroundings): void {
    this.#backdrop.setColors(colors.above, colors.below);
    this.#ground.setColor(colors.shadow);
    this.#surroundings = colors;
    this.invalidate();
  }

  get surroundings(): Surroundings {
    return this.#surroundings;
  }

  get immersed(): boolean {
    return this.#immersed;
  }

  /** From now on the headset of a session asks for pictures; `surface` ends that. */
  async immerse(session: XRSession, { camera, background, frame }: Immersion): Promise<void> {
    const { xr } = this.renderer;
    cancelAnimationFrame(this.#wanted);
    this.#wanted = 0;
    this.#immersed = xr.enabled = true;
    // A backdrop that goes with the head makes people sick.
    this.#backdrop.mesh.visible = this.#ground.mesh.visible = false;
    this.scene.background = background;
    xr.setReferenceSpaceType("local-floor");
    xr.setAnimationLoop((time: number, now?: XRFrame) => now && this.#present(time, camera, (seconds) => frame(seconds, now)));
    await xr.setSession(session);
  }

  /** The page's own clock and camera again. */
  surface(): void {
    const { renderer } = this;
    renderer.xr.setAnimationLoop(null);
    // At the end of a session the renderer begins to ask the page's clock.
    renderer.setAnimationLoop(null);
    this.#immersed = renderer.xr.enabled = false;
    this.#backdrop.mesh.visible = true;
    this.#ground.mesh.visible = this.#grounded;
    this.scene.background = null;
    this.resize();
  }

  /** What panels cover of the picture, pixels of CSS: the body is brought to the middle of what is left. */
  setInsets(insets: Insets): void {
    this.#panels = insets;
    this.resize();
  }

  /** What else is covered, of what panels leave; null: nothing. */
  cover(more: Insets | null): void {
    const same = (["left", "right", "top", "bottom"] as const).every((side) => (more?.[side] ?? 0) === (this.#more?.[side] ?? 0));
    this.#more = more;
    if (!same) this.resize();
  }

  /** What panels leave of the picture, pixels of CSS. */
  get free(): { left: number; top: number; width: number; height: number } {
    const { clientWidth, clientHeight } = this.canvas.parentElement!;
    const { left, right, top, bottom } = this.#panels;
    return { left, top, width: Math.max(80, clientWidth - left - right), height: Math.max(80, clientHeight - top - bottom) };
  }

  get #insets(): Insets {
    const sum = (side: keyof Insets) => this.#panels[side] + (this.#more?.[side] ?? 0);
    return { left: sum("left"), right: sum("right"), top: sum("top"), bottom: sum("bottom") };
  }

  /** Pixels of CSS of the whole picture, and of what no panel covers. */
  get size(): { width: number; height: number; freeWidth: number; freeHeight: number } {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement!;
    const { left, right, top, bottom } = this.#insets;
    return { width: Math.max(1, width), height: Math.max(1, height), freeWidth: Math.max(80, width - left - right), freeHeight: Math.max(80, height - top - bottom) };
  }

  /** The camera's window on the picture, moved so that what it looks at is in the middle of the free part; or one pixel of that. */
  window(pixel?: { x: number; y: number }): void {
    const { width, height } = this.size;
    const { left, right, top, bottom } = this.#insets;
    const x = (right - left) / 2, y = (bottom - top) / 2;
    if (pixel) this.camera.setViewOffset(width, height, Math.floor(pixel.x) + x, Math.floor(pixel.y) + y, 1, 1);
    else this.camera.setViewOffset(width, height, x, y, width, height);
  }

  /** Puts the ground under the body: `floor` is its lowest point, the radius that of its trunk, m. */
  placeGround(x: number, floor: number, z: number, radius: number): void {
    this.#ground.place(x, floor, z, radius);
    this.#grounded = true;
    this.#ground.mesh.visible = !this.#immersed;
  }

  resize(): void {
    const { width, height } = this.size;
    // A headset has a size of its own.
    if (!this.#immersed) {
      this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      this.renderer.setSize(width, height);
    }
    this.camera.aspect = width / height;
    this.window();
    for (const listener of [...this.#resized]) listener();
    this.invalidate();
  }

  /** The picture as it is now, as a PNG. */
  png(): Promise<Blob> {
    this.render();
    return new Promise((resolve, reject) => {
      this.canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("the browser made no picture"))), "image/png");
    });
  }

  render(): void {
    this.renderer.render(this.scene, this.camera);
  }

  #draw(time: number): void {
    this.#wanted = 0;
    this.#present(time, this.camera, () => this.controls.update());
  }

  #present(time: number, camera: THREE.Camera, last: (seconds: number) => void): void {
    const seconds = Math.min(0.1, (time - this.#last) / 1000);
    this.#last = time;
    for (const listener of [...this.#before]) listener(seconds);
    last(seconds);
    this.renderer.render(this.scene, camera);
    for (const listener of [...this.#after]) listener();
  }
}
