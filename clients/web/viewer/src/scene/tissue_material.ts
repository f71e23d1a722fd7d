// SPDX-License-Identifier: Apache-2.0
// The materials of the body: one per tissue, of three.js' ShaderMaterial over the GLSL beside it.
import * as THREE from "three";
import { CAP_COLOR, type Look } from "./palette.js";
import { DEPTH_FRAGMENT, DEPTH_VERTEX, OUTLINE_FRAGMENT, OUTLINE_VERTEX, PICK_FRAGMENT, PICK_VERTEX, TISSUE_FRAGMENT, TISSUE_VERTEX } from "./body_shader.js";

/** Uniforms that all tissues share: set once, seen by every material. */
export interface SharedUniforms {
  /** low x, y, z and step of the present frame, mm. */
  readonly poseBox: THREE.IUniform<THREE.Vector4>;
  readonly restBox: THREE.IUniform<THREE.Vector4>;
  /** What the darkest and the lightest colour of a scalar stand for. */
  readonly scalarRange: THREE.IUniform<THREE.Vector2>;
  /** Two colours that part in the middle of the range. */
  readonly scalarDiverges: THREE.IUniform<boolean>;
  readonly accent: THREE.IUniform<THREE.Color>;
  /** Pixels of the picture. */
  readonly viewport: THREE.IUniform<THREE.Vector2>;
}

export function sharedUniforms(): SharedUniforms {
  return {
    poseBox: { value: new THREE.Vector4() }, restBox: { value: new THREE.Vector4() },
    scalarRange: { value: new THREE.Vector2(0, 1) }, scalarDiverges: { value: false }, accent: { value: new THREE.Color(0x2f8fff) },
    viewport: { value: new THREE.Vector2(1, 1) },
  };
}

/** What colours the surface: nothing but the tissue, its distance from rest, or a number of each vertex. */
export type SurfaceScalar = "none" | "distance" | "values";

export class TissueMaterial extends THREE.ShaderMaterial {
  constructor(look: Look, shared: SharedUniforms) {
    super({
      vertexShader: TISSUE_VERTEX, fragmentShader: TISSUE_FRAGMENT, side: THREE.DoubleSide, clipping: true,
      uniforms: {
        color: { value: new THREE.Color(look.color) }, scatter: { value: new THREE.Color(look.scatter) },
        wrap: { value: look.wrap }, roughness: { value: look.roughness }, shine: { value: look.shine },
        opacity: { value: 1 }, glow: { value: 0 }, capColor: { value: new THREE.Color(CAP_COLOR) },
        accent: shared.accent, scalarRange: shared.scalarRange, scalarDiverges: shared.scalarDiverges, poseBox: shared.poseBox, restBox: shared.restBox,
      },
    });
  }

  /** 1 is solid; less is drawn after all that is solid, like glass. */
  setOpacity(opacity: number): void {
    const glass = opacity < 0.999;
    this.uniforms["opacity"]!.value = opacity;
    if (this.transparent === glass) return;
    this.transparent = glass;
    // Of glass only the front is seen; its depth was written before (Body.prepass), so that it is never blended with itself.
    this.side = glass ? THREE.FrontSide : THREE.DoubleSide;
    this.depthWrite = !glass;
    setDefine(this, "GLASS", glass);
  }

  /** 0 to 1: under the pointer, chosen. */
  setGlow(glow: number): void {
    this.uniforms["glow"]!.value = glow;
  }

  setScalar(kind: SurfaceScalar): void {
    setScalar(this, kind);
  }

  /** Its vertices have `cap`: where the border of the scan closes it, it is drawn flat. */
  setCapped(): void {
    setDefine(this, "CAP", true);
  }
}

/** Writes depth alone: the nearest surface of what is shown as glass. */
export function depthMaterial(): THREE.ShaderMaterial {
  return new THREE.ShaderMaterial({
    vertexShader: DEPTH_VERTEX, fragmentShader: DEPTH_FRAGMENT,
    colorWrite: false, transparent: true, side: THREE.FrontSide, clipping: true,
  });
}

/** Counts surfaces in the stencil: the far side of a tissue up, the near side down. What is left over is where a cut goes through it. */
export function countMaterial(side: THREE.Side, planes: THREE.Plane[]): THREE.ShaderMaterial {
  const count = side === THREE.BackSide ? THREE.IncrementWrapStencilOp : THREE.DecrementWrapStencilOp;
  return new THREE.ShaderMaterial({
    vertexShader: DEPTH_VERTEX, fragmentShader: DEPTH_FRAGMENT, side, clipping: true, clippingPlanes: planes,
    colorWrite: false, depthWrite: false, depthTest: false,
    stencilWrite: true, stencilFunc: THREE.AlwaysStencilFunc, stencilFail: count, stencilZFail: count, stencilZPass: count,
  });
}

export function outlineMaterial(shared: SharedUniforms): THREE.ShaderMaterial {
  return new THREE.ShaderMaterial({
    vertexShader: OUTLINE_VERTEX, fragmentShader: OUTLINE_FRAGMENT, side: THREE.BackSide, clipping: true,
    uniforms: { accent: shared.accent, viewport: shared.viewport, width: { value: 2.5 } },
  });
}

export class PickMaterial extends THREE.ShaderMaterial {
  constructor(row: number, shared: SharedUniforms) {
    super({
      glslVersion: THREE.GLSL3, vertexShader: PICK_VERTEX, fragmentShader: PICK_FRAGMENT, side: THREE.DoubleSide,
      blending: THREE.NoBlending, toneMapped: false, clipping: true,
      uniforms: { tissue: { value: row }, box: shared.poseBox, poseBox: shared.poseBox, restBox: shared.restBox, scalarRange: shared.scalarRange },
    });
  }

  setScalar(kind: SurfaceScalar): void {
    setScalar(this, kind);
  }

  setCapped(): void {
    setDefine(this, "CAP", true);
  }
}

function setScalar(material: THREE.ShaderMaterial, kind: SurfaceScalar): void {
  setDefine(material, "SCALAR", kind !== "none");
  setDefine(material, "SCALAR_VALUES", kind === "values");
}

function setDefine(material: THREE.ShaderMaterial, name: string, on: boolean): void {
  if ((name in material.defines) === on) return;
  if (on) material.defines[name] = "";
  else delete material.defines[name];
  material.needsUpdate = true;
}
