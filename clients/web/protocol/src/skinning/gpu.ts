// SPDX-License-Identifier: Apache-2.0
// Skinning on the GPU: once a pose, by transform feedback, into a buffer that is drawn from as the frames of a stream would be.
/// <reference path="./glsl_text.d.ts" />
import source from "../../../../shaders/skinning.glsl";
import { STRIDE } from "../decode/packed.js";
import { Skinning as Method } from "../gen/ecorche/v1/common_pb.js";
import { MotionTable, type Motions } from "./motions.js";
import type { Skinning } from "./skinning.js";

const WIDTH = 4096;
const SAMPLERS = ["points", "weights", "hung", "hungNodes", "hungShares", "motions"] as const;

/** Needs no rasteriser, no extension and no readback. Leaves the context's state changed: three.js' `renderer.resetState()` mends it. */
export class GpuSkinner {
  /** u16 x, y, z and normal for each vertex, in `box`. */
  readonly buffer: WebGLBuffer;
  private readonly table: MotionTable;
  private readonly textures: WebGLTexture[];
  private readonly programs = new Map<number, WebGLProgram>();
  private readonly feedback: WebGLTransformFeedback;
  private readonly array: WebGLVertexArrayObject;

  /** Throws where the GPU takes no such table. */
  constructor(private readonly gl: WebGL2RenderingContext, readonly skinning: Skinning) {
    const { points, weights, hung, hungNodes, hungShares, vertexCount, segments } = skinning;
    this.table = new MotionTable(skinning);
    this.buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, Math.max(1, vertexCount) * STRIDE * 2, gl.DYNAMIC_COPY);
    gl.bindBuffer(gl.ARRAY_BUFFER, null);
    this.feedback = gl.createTransformFeedback();
    this.array = gl.createVertexArray();
    this.textures = [
      this.texture(points, gl.RGBA16UI, gl.RGBA_INTEGER, gl.UNSIGNED_SHORT, 4),
      this.texture(weights, gl.RG16UI, gl.RG_INTEGER, gl.UNSIGNED_SHORT, 2),
      this.texture(hung, gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT, 1),
      this.texture(hungNodes, gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT, 4),
      this.texture(hungShares, gl.RGBA32F, gl.RGBA, gl.FLOAT, 4),
      this.texture(new Float32Array(8 * segments), gl.RGBA32F, gl.RGBA, gl.FLOAT, 4),
    ];
  }

  get box() {
    return this.table.box;
  }

  skin(motions: Motions): void {
    const { gl, table, skinning } = this, { vertexCount, box } = skinning;
    table.set(motions);
    const program = this.program(motions.method);
    gl.useProgram(program);
    this.textures.forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    });
    upload(gl, table.rows, gl.RGBA, gl.FLOAT, 4);
    gl.uniform1f(gl.getUniformLocation(program, "restStep"), box.scale);
    gl.uniform1f(gl.getUniformLocation(program, "posedStep"), table.box.scale);
    gl.bindVertexArray(this.array);
    // Whoever drew from the buffer may have left it bound, and WebGL writes into none that is bound elsewhere.
    gl.bindBuffer(gl.ARRAY_BUFFER, null);
    gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, this.feedback);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, this.buffer);
    gl.enable(gl.RASTERIZER_DISCARD);
    gl.beginTransformFeedback(gl.POINTS);
    gl.drawArrays(gl.POINTS, 0, vertexCount);
    gl.endTransformFeedback();
    gl.disable(gl.RASTERIZER_DISCARD);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, null);
    gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, null);
    gl.bindVertexArray(null);
    gl.activeTexture(gl.TEXTURE0);
  }

  /** Waits for the GPU. */
  read(): Uint16Array<ArrayBuffer> {
    const { gl } = this, out = new Uint16Array(this.skinning.vertexCount * STRIDE);
    gl.bindBuffer(gl.COPY_READ_BUFFER, this.buffer);
    gl.getBufferSubData(gl.COPY_READ_BUFFER, 0, out);
    gl.bindBuffer(gl.COPY_READ_BUFFER, null);
    return out;
  }

  dispose(): void {
    const { gl } = this;
    for (const texture of this.textures) gl.deleteTexture(texture);
    for (const program of this.programs.values()) gl.deleteProgram(program);
    gl.deleteTransformFeedback(this.feedback);
    gl.deleteVertexArray(this.array);
    gl.deleteBuffer(this.buffer);
  }

  private program(method: Method): WebGLProgram {
    const number = method === Method.LBS ? 1 : method === Method.DQS ? 2 : 3;
    let program = this.programs.get(number);
    if (!program) this.programs.set(number, program = link(this.gl, number, this.skinning.influences));
    return program;
  }

  private texture(data: Uint16Array | Uint32Array | Float32Array, internal: number, format: number, type: number, channels: number): WebGLTexture {
    const { gl } = this, rows = Math.max(1, Math.ceil(data.length / channels / WIDTH));
    if (rows > gl.getParameter(gl.MAX_TEXTURE_SIZE) || WIDTH > gl.getParameter(gl.MAX_TEXTURE_SIZE)) throw new Error("the body is too large to be skinned by this GPU");
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, internal, WIDTH, rows);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    upload(gl, data, format, type, channels);
    return texture;
  }
}

/** Into the bound texture: whole rows, then what is left. */
function upload(gl: WebGL2RenderingContext, data: Uint16Array | Uint32Array | Float32Array, format: number, type: number, channels: number): void {
  gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, false);
  gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
  const texels = data.length / channels, rows = Math.floor(texels / WIDTH), left = texels - rows * WIDTH;
  if (rows > 0) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, WIDTH, rows, format, type, data, 0);
  if (left > 0) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, rows, left, 1, format, type, data, rows * WIDTH * channels);
}

function link(gl: WebGL2RenderingContext, method: number, influences: number): WebGLProgram {
  const program = gl.createProgram();
  const shader = (type: number, text: string) => {
    const made = gl.createShader(type)!;
    gl.shaderSource(made, text);
    gl.compileShader(made);
    gl.attachShader(program, made);
    return made;
  };
  const shaders = [
    shader(gl.VERTEX_SHADER, `#version 300 es\n#define METHOD ${method}\n#define INFLUENCES ${influences}\n${source}`),
    shader(gl.FRAGMENT_SHADER, "#version 300 es\nvoid main() {}\n"),
  ];
  gl.transformFeedbackVaryings(program, ["posed"], gl.INTERLEAVED_ATTRIBS);
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
    throw new Error(`the skinning shader does not compile: ${shaders.map((each) => gl.getShaderInfoLog(each)).join("")}${gl.getProgramInfoLog(program)}`);
  }
  for (const each of shaders) gl.deleteShader(each);
  gl.useProgram(program);
  SAMPLERS.forEach((name, unit) => gl.uniform1i(gl.getUniformLocation(program, name), unit));
  return program;
}
