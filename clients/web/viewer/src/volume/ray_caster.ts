// SPDX-License-Identifier: Apache-2.0
// The volume in the picture: rays into a target of its own, laid over the solid surfaces and under what is glass. Drawn anew only when
// something of it has changed; coarser while it moves, in full once it rests.
import * as THREE from "three";
import type { Body } from "../scene/body.js";
import type { Stage } from "../scene/stage.js";
import { BLOCK, type VolumeTexture } from "./volume_texture.js";
import { OVER_FRAGMENT, OVER_VERTEX, RAY_FRAGMENT, RAY_VERTEX } from "./ray_shader.js";
import { SolidDepth } from "./solid_depth.js";
import { TABLE_SIZE, tableOf, Visible, type TransferPreset } from "./transfer.js";

export interface Looks {
  readonly preset: TransferPreset;
  readonly level: number;
  readonly width: number;
  /** Times every opacity. */
  readonly density: number;
  readonly shaded: boolean;
}

// After the solid tissues and their outline, before glass: scene/body.ts.
const ORDER = 5;
const REST_MS = 180;
/** Of the picture's pixels along a side, and of a voxel that a step goes. */
const MOVING = { scale: 0.4, step: 1.4 }, RESTING = { scale: 1, step: 0.4 };

export class RayCaster {
  readonly #over: THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial>;
  readonly #rays: THREE.ShaderMaterial;
  readonly #scene = new THREE.Scene();
  readonly #eye = new THREE.Camera();
  readonly #depth: SolidDepth;
  readonly #target: THREE.WebGLRenderTarget;
  readonly #solid: THREE.WebGLRenderTarget;
  #volume: VolumeTexture | null = null;
  #occupied: THREE.Data3DTexture | null = null;
  #stale = true;
  #seen = "";
  #movedAt = 0;
  #later: ReturnType<typeof setTimeout> | undefined;
  /** The last picture is a coarse one. */
  coarse = false;

  constructor(private readonly stage: Stage, private readonly body: Body) {
    const triangle = new THREE.BufferGeometry();
    triangle.setAttribute("position", new THREE.Float32BufferAttribute([-1, -1, 0, 3, -1, 0, -1, 3, 0], 3));
    this.#depth = new SolidDepth(stage, body);
    const half = stage.renderer.extensions.has("EXT_color_buffer_float") || stage.renderer.extensions.has("EXT_color_buffer_half_float");
    this.#target = new THREE.WebGLRenderTarget(1, 1, { type: half ? THREE.HalfFloatType : THREE.UnsignedByteType, depthBuffer: false, minFilter: THREE.LinearFilter, magFilter: THREE.LinearFilter });
    this.#solid = new THREE.WebGLRenderTarget(1, 1, { depthTexture: new THREE.DepthTexture(1, 1, THREE.UnsignedIntType) });
    this.#rays = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader: RAY_VERTEX, fragmentShader: RAY_FRAGMENT, depthTest: false, depthWrite: false, blending: THREE.NoBlending,
      uniforms: {
        volume: { value: null }, occupied: { value: null }, transfer: { value: null }, depth: { value: this.#solid.depthTexture },
        fromClip: { value: new THREE.Matrix4() }, extent: { value: new THREE.Vector3() }, texels: { value: new THREE.Vector3() },
        plane: { value: new THREE.Vector4(0, 0, 0, 1) }, window: { value: new THREE.Vector2() }, stepMm: { value: 1 }, density: { value: 1 }, shading: { value: 1 },
      },
    });
    const screen = new THREE.Mesh(triangle, this.#rays);
    screen.frustumCulled = false;
    this.#scene.add(screen);
    this.#over = new THREE.Mesh(triangle, new THREE.ShaderMaterial({
      vertexShader: OVER_VERTEX, fragmentShader: OVER_FRAGMENT, uniforms: { rays: { value: this.#target.texture } },
      transparent: true, premultipliedAlpha: true, blending: THREE.CustomBlending, blendSrc: THREE.OneFactor, blendDst: THREE.OneMinusSrcAlphaFactor,
      depthTest: false, depthWrite: false, toneMapped: false,
    }));
    Object.assign(this.#over, { frustumCulled: false, renderOrder: ORDER, visible: false });
    this.#over.onBeforeRender = (_renderer, _scene, camera) => this.#draw(camera);
    stage.scene.add(this.#over);
    this.topologyChanged();
  }

  get shown(): boolean {
    return this.#over.visible;
  }

  get volume(): VolumeTexture | null {
    return this.#volume;
  }

  setShown(on: boolean): void {
    this.#over.visible = on && this.#volume !== null;
    this.changed();
  }

  /** Takes it over, and frees the one before. */
  setVolume(volume: VolumeTexture, looks: Looks): void {
    this.#volume?.dispose();
    this.#volume = volume;
    const { uniforms } = this.#rays;
    uniforms["volume"]!.value = volume.texture;
    (uniforms["extent"]!.value as THREE.Vector3).copy(volume.extent);
    (uniforms["texels"]!.value as THREE.Vector3).set(...volume.size);
    this.setLooks(looks);
  }

  setLooks({ preset, level, width, density, shaded }: Looks): void {
    const volume = this.#volume;
    if (!volume) return;
    const table = tableOf(preset), visible = new Visible(table), { uniforms } = this.#rays;
    const low = level - width / 2, place = (value: number) => (value - low) / width;
    const transfer = new THREE.DataTexture(Uint16Array.from(table, (value) => THREE.DataUtils.toHalfFloat(value)), TABLE_SIZE, 1, THREE.RGBAFormat, THREE.HalfFloatType);
    Object.assign(transfer, { minFilter: THREE.LinearFilter, magFilter: THREE.LinearFilter, needsUpdate: true });
    (uniforms["transfer"]!.value as THREE.Texture | null)?.dispose();
    uniforms["transfer"]!.value = transfer;
    // The middles of the table's first and last entry are 0 and 1.
    const inner = (TABLE_SIZE - 1) / TABLE_SIZE;
    (uniforms["window"]!.value as THREE.Vector2).set(inner / (volume.coding.scale * width), inner * place(volume.coding.middle) + 0.5 / TABLE_SIZE);
    uniforms["density"]!.value = density;
    uniforms["shading"]!.value = shaded ? 1 : 0;
    this.#occupied?.dispose();
    this.#occupied = new THREE.Data3DTexture(volume.occupied((from, to) => visible.between(place(from), place(to))), ...volume.blocks);
    Object.assign(this.#occupied, { format: THREE.RedFormat, type: THREE.UnsignedByteType, minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter, unpackAlignment: 1, needsUpdate: true });
    uniforms["occupied"]!.value = this.#occupied;
    this.changed();
  }

  /** Something that the rays meet is another: surfaces, the clipping plane, the volume. */
  changed(): void {
    this.#stale = true;
    if (this.#over.visible) this.stage.invalidate();
  }

  topologyChanged(): void {
    this.#depth.follow();
    this.changed();
  }

  /** Red, green, blue (linear, times alpha) and alpha of a ray, 0 to 1 from the lower left; for tests. */
  read(x: number, y: number): number[] {
    const { width, height, texture } = this.#target, half = texture.type === THREE.HalfFloatType;
    const pixel = half ? new Uint16Array(4) : new Uint8Array(4);
    this.stage.renderer.readRenderTargetPixels(this.#target, Math.floor(x * width), Math.floor(y * height), 1, 1, pixel);
    return Array.from(pixel, (value) => (half ? THREE.DataUtils.fromHalfFloat(value) : value / 255));
  }

  dispose(): void {
    clearTimeout(this.#later);
    this.stage.scene.remove(this.#over);
    for (const each of [this.#target, this.#solid, this.#volume, this.#occupied]) each?.dispose();
  }

  /** Within the drawing of the picture, with the camera that it has. */
  #draw(camera: THREE.Camera): void {
    const volume = this.#volume, { renderer } = this.stage;
    // A picture for each eye would take twice as long as a headset waits.
    if (!volume || this.stage.immersed) return;
    const size = renderer.getDrawingBufferSize(new THREE.Vector2()), planes = this.body.clipping;
    const cut = planes.flatMap(({ normal, constant }) => [...normal.toArray(), constant]);
    const view = [...camera.matrixWorldInverse.elements, ...camera.projectionMatrix.elements, ...cut].join();
    const now = performance.now();
    if (view !== this.#seen || this.#stale) this.#movedAt = this.#seen === "" ? 0 : now;
    const resting = now - this.#movedAt >= REST_MS, { scale, step } = resting ? RESTING : MOVING;
    clearTimeout(this.#later);
    if (!resting) this.#later = setTimeout(() => this.stage.invalidate(), REST_MS + 10);
    const width = Math.max(1, Math.round(size.x * scale)), height = Math.max(1, Math.round(size.y * scale));
    if (!this.#stale && view === this.#seen && this.#target.width === width && this.#target.height === height) return;
    this.#stale = false;
    this.#seen = view;
    this.coarse = !resting;
    const { uniforms } = this.#rays, toTexture = volume.toTexture.clone().multiply(this.stage.patient.matrix.clone().invert());
    const toWorld = camera.matrixWorld.clone().multiply(camera.projectionMatrixInverse);
    (uniforms["fromClip"]!.value as THREE.Matrix4).multiplyMatrices(toTexture, toWorld);
    uniforms["stepMm"]!.value = step * Math.min(...volume.extent.toArray().map((mm, axis) => mm / volume.size[axis]!));
    const plane = uniforms["plane"]!.value as THREE.Vector4, [first] = planes;
    if (first) plane.set(first.normal.x, first.normal.y, first.normal.z, first.constant).applyMatrix4(toTexture.clone().invert().transpose());
    else plane.set(0, 0, 0, 1);
    this.#render(width, height, camera, planes);
  }

  #render(width: number, height: number, camera: THREE.Camera, planes: THREE.Plane[]): void {
    const { renderer } = this.stage, before = renderer.getRenderTarget(), { enabled } = renderer.xr;
    const color = renderer.getClearColor(new THREE.Color()), alpha = renderer.getClearAlpha();
    renderer.xr.enabled = false;
    renderer.setClearColor(0, 0);
    for (const target of [this.#solid, this.#target]) if (target.width !== width || target.height !== height) target.setSize(width, height);
    renderer.setRenderTarget(this.#solid);
    renderer.clear();
    this.#depth.draw(camera, planes);
    renderer.setRenderTarget(this.#target);
    renderer.render(this.#scene, this.#eye);
    renderer.setRenderTarget(before);
    renderer.setClearColor(color, alpha);
    renderer.xr.enabled = enabled;
  }
}

// The shader knows it, too.
if (BLOCK !== 8) throw new Error("rays skip blocks of 8 texels");
