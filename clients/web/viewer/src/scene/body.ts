// SPDX-License-Identifier: Apache-2.0
// The posed body in the scene: one buffer of u16 positions and octahedral normals for all tissues, as the stream decodes it, and one
// range of triangles per tissue. Nothing is converted on the way to the GPU; low and step of a frame are the group's matrix.
import * as THREE from "three";
import type { Look } from "./palette.js";
import { depthMaterial, outlineMaterial, PickMaterial, sharedUniforms, TissueMaterial, type SurfaceScalar } from "./tissue_material.js";

export interface TissueRange {
  /** Row of ModelOpened.tissues. */
  readonly row: number;
  readonly firstVertex: number;
  readonly vertexCount: number;
  /** Into the triangles' indices, which count vertices of the whole buffer. */
  readonly firstIndex: number;
  readonly indexCount: number;
}

export interface Topology {
  readonly vertices: number;
  readonly indices: Uint32Array;
  readonly ranges: readonly TissueRange[];
  /** 255 for each vertex of a cap, where the border of the scan cuts the body: a triangle of three such is no tissue. */
  readonly caps?: Uint8Array | null;
}

/** p = low + step * number, mm, LPS. Four numbers a vertex: x, y, z and the normal. */
export interface Positions {
  /** Of positions that lie on the GPU read back when they are asked for. */
  readonly numbers: Uint16Array;
  /** Where they lie on the GPU already. */
  readonly gpu?: WebGLBuffer;
  readonly low: readonly [number, number, number];
  readonly step: number;
}

/** Numbers per vertex. */
export const STRIDE = 4;

// Drawn in this order: what is solid, the outline of the chosen, then depth and colour of what is glass, from inside outwards.
const ORDER = { solid: 0, outline: 1, depth: 10, glass: 11 } as const;

interface Part {
  readonly range: TissueRange;
  readonly geometry: THREE.BufferGeometry;
  readonly mesh: THREE.Mesh<THREE.BufferGeometry, TissueMaterial>;
  readonly prepass: THREE.Mesh;
  readonly pick: THREE.Mesh<THREE.BufferGeometry, PickMaterial>;
}

export class Body {
  /** Child of Stage.patient; its matrix places the numbers of a frame, mm. */
  readonly group = new THREE.Group();
  /** The same parts once more, for the picker alone. */
  readonly pickGroup = new THREE.Group();
  readonly shared = sharedUniforms();
  #parts = new Map<number, Part>();
  #topology: Topology | null = null;
  #positions: Positions | null = null;
  #buffer: THREE.InterleavedBuffer | null = null;
  #gpu: WebGLBuffer | null = null;
  #rest: Positions | null = null;
  #outline: THREE.Mesh;
  #scalar: SurfaceScalar = "none";
  #values: Float32Array | null = null;
  #clipping: THREE.Plane[] = [];

  constructor(private readonly looks: (row: number) => Look) {
    for (const group of [this.group, this.pickGroup]) group.matrixAutoUpdate = false;
    this.#outline = new THREE.Mesh(new THREE.BufferGeometry(), outlineMaterial(this.shared));
    this.#outline.frustumCulled = false;
    this.#outline.visible = false;
    this.#outline.renderOrder = ORDER.outline;
    this.group.add(this.#outline);
  }

  get topology(): Topology | null {
    return this.#topology;
  }

  get positions(): Positions | null {
    return this.#positions;
  }

  get rest(): Positions | null {
    return this.#rest;
  }

  /** Another level of detail or another model. Positions follow before anything is drawn. */
  setTopology(topology: Topology): void {
    this.#clear();
    this.#topology = topology;
  }

  setPositions(positions: Positions): void {
    const { low, step } = positions;
    this.#positions = positions;
    this.shared.poseBox.value.set(low[0], low[1], low[2], step);
    for (const group of [this.group, this.pickGroup]) {
      group.matrix.makeScale(step, step, step).setPosition(low[0], low[1], low[2]);
      group.matrixWorldNeedsUpdate = true;
    }
    if (this.#parts.size === 0) {
      this.#build(positions);
    } else if ((positions.gpu ?? null) !== this.#gpu) {
      // It comes another way now.
      const vertex = this.#source(positions);
      for (const { geometry } of this.#parts.values()) geometry.setAttribute("vertex", vertex);
    } else if (this.#buffer) {
      this.#buffer.array = positions.numbers;
      this.#buffer.needsUpdate = true;
    }
  }

  /** The scanned body, of the same topology, for the distance from it. */
  setRest(rest: Positions | null): void {
    this.#rest = rest;
    if (!rest) return this.setScalar("none");
    this.shared.restBox.value.set(rest.low[0], rest.low[1], rest.low[2], rest.step);
    const buffer = new THREE.InterleavedBuffer(rest.numbers, STRIDE);
    for (const { geometry } of this.#parts.values()) {
      geometry.setAttribute("rest", integers(buffer));
    }
  }

  /** A number for each vertex of the topology, to colour the surface by; null: none. */
  setValues(values: Float32Array | null): void {
    this.#values = values;
    if (!values) return this.#scalar === "values" ? this.setScalar("none") : undefined;
    const attribute = new THREE.BufferAttribute(values, 1);
    for (const { geometry } of this.#parts.values()) geometry.setAttribute("value", attribute);
  }

  get values(): Float32Array | null {
    return this.#values;
  }

  /** Colours the surface by what there is of it. */
  setScalar(kind: SurfaceScalar): void {
    const there = { none: true, distance: this.#rest !== null, values: this.#values !== null }[kind];
    this.#scalar = there ? kind : "none";
    for (const { mesh, pick } of this.#parts.values()) {
      mesh.material.setScalar(this.#scalar);
      pick.material.setScalar(this.#scalar);
    }
  }

  get scalar(): SurfaceScalar {
    return this.#scalar;
  }

  setOpacity(row: number, opacity: number): void {
    const part = this.#parts.get(row);
    if (!part) return;
    part.mesh.visible = opacity > 0;
    part.mesh.material.setOpacity(opacity);
    part.mesh.renderOrder = part.mesh.material.transparent ? ORDER.glass : ORDER.solid;
    part.prepass.visible = part.mesh.visible && part.mesh.material.transparent;
    part.pick.visible = part.mesh.visible;
    part.pick.userData["glass"] = part.mesh.material.transparent;
  }

  /** How strongly a tissue is drawn, 0 to 1. */
  shown(row: number): number {
    const mesh = this.#parts.get(row)?.mesh;
    return mesh?.visible ? (mesh.material.uniforms["opacity"]!.value as number) : 0;
  }

  setGlow(row: number, glow: number): void {
    this.#parts.get(row)?.mesh.material.setGlow(glow);
  }

  /** Draws the outline of one tissue; null: of none. */
  setOutline(row: number | null): void {
    const part = row === null ? undefined : this.#parts.get(row);
    this.#outline.visible = part !== undefined && part.mesh.visible;
    if (part) this.#outline.geometry = part.geometry;
  }

  /** What lies behind these planes (of the scene) is not drawn, nor picked. */
  setClipping(planes: THREE.Plane[]): void {
    this.#clipping = planes;
    (this.#outline.material as THREE.Material).clippingPlanes = planes;
    for (const part of this.#parts.values()) this.#clip(part);
  }

  get clipping(): THREE.Plane[] {
    return this.#clipping;
  }

  /** Triangles of a tissue, in numbers of the present frame. */
  geometry(row: number): THREE.BufferGeometry | undefined {
    return this.#parts.get(row)?.geometry;
  }

  #clip({ mesh, prepass, pick }: Part): void {
    for (const { material } of [mesh, prepass, pick]) (material as THREE.Material).clippingPlanes = this.#clipping;
  }

  /** Where the border of the scan cuts a tissue: which of its triangles, counted from its first, are a cap. */
  isCap(row: number): ((triangle: number) => boolean) | null {
    const { caps, indices } = this.#topology ?? {}, range = this.#topology?.ranges.find((each) => each.row === row);
    if (!caps || !indices || !range || !isCut(caps, range)) return null;
    return (triangle) => [0, 1, 2].every((corner) => caps[indices[range.firstIndex + 3 * triangle + corner]!]! > 0);
  }

  range(row: number): TissueRange | undefined {
    return this.#parts.get(row)?.range;
  }

  /** Of the present frame, mm, LPS; of some tissues, or all that are shown. Empty before the first frame. */
  bounds(rows?: readonly number[]): THREE.Box3 {
    const box = new THREE.Box3();
    if (!this.#positions) return box;
    const { numbers, low, step } = this.#positions;
    for (const { range, mesh } of this.#parts.values()) {
      if (rows ? !rows.includes(range.row) : !mesh.visible) continue;
      const least = [Infinity, Infinity, Infinity], most = [-Infinity, -Infinity, -Infinity];
      for (let at = range.firstVertex * STRIDE, end = at + range.vertexCount * STRIDE; at < end; at += STRIDE) {
        for (let axis = 0; axis < 3; axis++) {
          const value = numbers[at + axis]!;
          if (value < least[axis]!) least[axis] = value;
          if (value > most[axis]!) most[axis] = value;
        }
      }
      if (range.vertexCount === 0) continue;
      const place = (from: readonly number[]) => new THREE.Vector3(...low.map((value, axis) => value + step * from[axis]!));
      box.expandByPoint(place(least)).expandByPoint(place(most));
    }
    return box;
  }

  #build(positions: Positions): void {
    const topology = this.#topology;
    if (!topology) return;
    const vertex = this.#source(positions);
    const index = new THREE.BufferAttribute(topology.indices, 1);
    const depth = depthMaterial();
    const cap = topology.caps ? new THREE.BufferAttribute(topology.caps, 1, true) : null;
    for (const range of topology.ranges) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("vertex", vertex).setIndex(index);
      geometry.setDrawRange(range.firstIndex, range.indexCount);
      const mesh = new THREE.Mesh(geometry, new TissueMaterial(this.looks(range.row), this.shared));
      const prepass = new THREE.Mesh(geometry, depth);
      const pick = new THREE.Mesh(geometry, new PickMaterial(range.row, this.shared));
      if (cap && isCut(topology.caps!, range)) {
        geometry.setAttribute("cap", cap);
        for (const { material } of [mesh, pick]) material.setCapped();
      }
      prepass.visible = false;
      prepass.renderOrder = ORDER.depth;
      // Bounds would be those of numbers that change under them; the body is nearly always in view as a whole.
      for (const each of [mesh, prepass, pick]) each.frustumCulled = false;
      this.group.add(mesh, prepass);
      this.pickGroup.add(pick);
      const part = { range, geometry, mesh, prepass, pick };
      this.#clip(part);
      this.#parts.set(range.row, part);
    }
  }

  #source(positions: Positions): THREE.InterleavedBufferAttribute | THREE.BufferAttribute {
    const { gpu } = positions;
    this.#gpu = gpu ?? null;
    this.#buffer = gpu ? null : new THREE.InterleavedBuffer(positions.numbers, STRIDE).setUsage(THREE.StreamDrawUsage);
    return gpu ? resident(gpu, this.#topology!.vertices) : integers(this.#buffer!);
  }

  #clear(): void {
    for (const { geometry, mesh, prepass, pick } of this.#parts.values()) {
      geometry.dispose();
      mesh.material.dispose();
      pick.material.dispose();
      this.group.remove(mesh, prepass);
      this.pickGroup.remove(pick);
    }
    this.#parts.clear();
    this.#outline.visible = false;
    this.#buffer = this.#gpu = null;
    this.#positions = null;
    this.#rest = null;
    this.#values = null;
  }
}

function isCut(caps: Uint8Array, { firstVertex, vertexCount }: TissueRange): boolean {
  return caps.subarray(firstVertex, firstVertex + vertexCount).includes(255);
}

/** The same of numbers that are on the GPU. */
function resident(buffer: WebGLBuffer, count: number): THREE.BufferAttribute {
  const attribute = new THREE.GLBufferAttribute(buffer, WebGL2RenderingContext.UNSIGNED_SHORT, STRIDE, 2, count);
  // three.js draws from it as from any other, though its types do not say so.
  return Object.assign(attribute, { gpuType: THREE.IntType }) as unknown as THREE.BufferAttribute;
}

/** An attribute that the shader reads as `uvec4`. */
function integers(buffer: THREE.InterleavedBuffer): THREE.InterleavedBufferAttribute {
  return Object.assign(new THREE.InterleavedBufferAttribute(buffer, STRIDE, 0, false), { gpuType: THREE.IntType });
}
