// SPDX-License-Identifier: Apache-2.0
// The radiograph of the surfaces, made by the graphics card: every fragment adds its distance from the source where the ray leaves a
// tissue and takes it away where it enters, times what the tissue attenuates. The same as line_integrals() of surfaces on the server.
import * as THREE from "three";
import { cross, dot, subtract, type Vec3 } from "../posing/rotation.js";
import type { Body } from "../scene/body.js";
import { VERTEX } from "../scene/body_shader.js";
import type { Setup } from "./setup.js";

const FACES = /* glsl */ `
${VERTEX}
uniform vec4 poseBox;   // low, step
uniform vec3 source;
uniform vec3 right;
uniform vec3 down;
uniform vec3 beam;
uniform vec4 plate;     // half of its size, and where its middle is beside the central ray
uniform float sid;
varying vec3 vWay;
void main() {
  vec3 way = bodyPosition() * poseBox.w + (poseBox.xyz - source);
  vWay = vec3(dot(way, right), dot(way, down), dot(way, beam));
  // No depth: nothing is cut off before or behind. The first row of the target is the top of the picture.
  gl_Position = vec4((vWay.xy * sid - plate.zw * vWay.z) / plate.xy, 0.0, vWay.z);
}
`;

const FRAGMENT = /* glsl */ `
uniform float attenuation;
uniform float sid;
uniform float middle;
uniform bool mirrored;
varying vec3 vWay;
void main() {
  // What lies behind the detector is not seen. Ways are counted from about the middle of the body, so that short numbers are added.
  float way = length(vWay) * min(1.0, sid / vWay.z) - middle;
  // The picture's rows run down: a face that the ray enters by is seen turned.
  bool leaves = gl_FrontFacing != mirrored;
  gl_FragColor = vec4(attenuation * (leaves ? way : -way), 0.0, 0.0, 1.0);
}
`;

export interface Attenuating {
  /** Row of the tissue. */
  readonly row: number;
  /** 1/mm, beyond what it lies in. */
  readonly attenuation: number;
}

export interface Support {
  /** Of the numbers that are added up; null: this browser adds up none. */
  readonly type: typeof THREE.FloatType | typeof THREE.HalfFloatType | null;
  /** In plain words; empty: nothing. */
  readonly missing: string;
}

/** What this browser's graphics can add up. */
export function supportOf(has: (extension: string) => boolean): Support {
  if (has("EXT_color_buffer_float")) {
    if (has("EXT_float_blend")) return { type: THREE.FloatType, missing: "" };
    return { type: THREE.HalfFloatType, missing: "This browser's graphics lack EXT_float_blend: the live picture is coarser." };
  }
  if (has("EXT_color_buffer_half_float")) {
    return { type: THREE.HalfFloatType, missing: "This browser's graphics lack EXT_color_buffer_float: the live picture is coarser." };
  }
  return { type: null, missing: "This browser's graphics lack EXT_color_buffer_float: there is no live picture. The server's own is there." };
}

export class LivePicture {
  readonly support: Support;
  readonly #scene = new THREE.Scene();
  readonly #camera = new THREE.Camera();
  readonly #shared = {
    poseBox: { value: new THREE.Vector4() }, source: { value: new THREE.Vector3() }, right: { value: new THREE.Vector3() },
    down: { value: new THREE.Vector3() }, beam: { value: new THREE.Vector3() }, plate: { value: new THREE.Vector4() },
    sid: { value: 0 }, middle: { value: 0 }, mirrored: { value: false },
  };
  readonly #materials = new Map<number, THREE.ShaderMaterial>();
  #target: THREE.WebGLRenderTarget | null = null;
  #pixels: Float32Array | Uint16Array = new Float32Array();

  constructor(private readonly renderer: THREE.WebGLRenderer) {
    this.support = supportOf((name) => renderer.extensions.has(name));
    this.#scene.matrixWorldAutoUpdate = false;
  }

  /** Line integrals, row by row from the top. The buffers are used again by the next call. */
  async render(body: Body, tissues: readonly Attenuating[], setup: Setup, columns: number, rows: number): Promise<Float32Array> {
    const { type } = this.support, { renderer } = this;
    if (type === null) throw new Error(this.support.missing);
    const target = this.#sized(columns, rows, type);
    this.#place(body, setup);
    this.#scene.clear();
    for (const { row, attenuation } of tissues) {
      const geometry = body.geometry(row);
      if (!geometry || attenuation === 0) continue;
      const mesh = new THREE.Mesh(geometry, this.#material(attenuation));
      mesh.frustumCulled = false;
      this.#scene.add(mesh);
    }
    const before = renderer.getRenderTarget(), color = renderer.getClearColor(new THREE.Color()), alpha = renderer.getClearAlpha();
    const { enabled } = renderer.xr;
    renderer.xr.enabled = false;
    renderer.setRenderTarget(target);
    renderer.setClearColor(0, 0);
    renderer.clear();
    renderer.render(this.#scene, this.#camera);
    renderer.setRenderTarget(before);
    renderer.setClearColor(color, alpha);
    renderer.xr.enabled = enabled;
    await renderer.readRenderTargetPixelsAsync(target, 0, 0, columns, rows, this.#pixels);
    const out = new Float32Array(columns * rows), { fromHalfFloat } = THREE.DataUtils;
    // Rounding may leave a little less than nothing.
    for (let i = 0; i < out.length; i++) {
      const sum = type === THREE.FloatType ? this.#pixels[4 * i]! : fromHalfFloat(this.#pixels[4 * i]!);
      out[i] = Math.max(0, sum);
    }
    return out;
  }

  #place(body: Body, { source, detector, sid }: Setup): void {
    const { right, down, centre, width, height } = detector, shared = this.#shared;
    const across = cross(right, down), toDetector = subtract(centre, source);
    const mirrored = dot(across, toDetector) < 0;
    const beam: Vec3 = mirrored ? [-across[0], -across[1], -across[2]] : across;
    shared.poseBox.value.copy(body.shared.poseBox.value);
    shared.source.value.set(...source);
    shared.right.value.set(...right);
    shared.down.value.set(...down);
    shared.beam.value.set(...beam);
    shared.plate.value.set(width / 2, height / 2, dot(right, toDetector), dot(down, toDetector));
    shared.sid.value = sid;
    // The detector stands behind the body: somewhere before it.
    shared.middle.value = Math.max(0, sid - 200);
    shared.mirrored.value = mirrored;
  }

  #sized(columns: number, rows: number, type: THREE.TextureDataType): THREE.WebGLRenderTarget {
    if (this.#target?.width === columns && this.#target.height === rows) return this.#target;
    this.#target?.dispose();
    this.#target = new THREE.WebGLRenderTarget(columns, rows, {
      format: THREE.RGBAFormat, type, minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter, generateMipmaps: false, depthBuffer: false,
    });
    this.#pixels = type === THREE.FloatType ? new Float32Array(4 * columns * rows) : new Uint16Array(4 * columns * rows);
    return this.#target;
  }

  #material(attenuation: number): THREE.ShaderMaterial {
    let material = this.#materials.get(attenuation);
    if (!material) {
      if (this.#materials.size > 64) this.#forget();
      material = new THREE.ShaderMaterial({
        vertexShader: FACES, fragmentShader: FRAGMENT, uniforms: { ...this.#shared, attenuation: { value: attenuation } }, side: THREE.DoubleSide,
        transparent: true, depthTest: false, depthWrite: false, toneMapped: false,
        blending: THREE.CustomBlending, blendEquation: THREE.AddEquation, blendSrc: THREE.OneFactor, blendDst: THREE.OneFactor,
      });
      this.#materials.set(attenuation, material);
    }
    return material;
  }

  #forget(): void {
    for (const material of this.#materials.values()) material.dispose();
    this.#materials.clear();
  }
}
