// SPDX-License-Identifier: Apache-2.0
// Compiled against the package's types, strictly; not run.
import { Client, Encoding, type BodyFrame, type MeshStream } from "ecorche-client";
import { GpuSkinner } from "ecorche-client/skinning";

export async function watch(url: string, gl: WebGL2RenderingContext): Promise<number> {
  const client: Client = await Client.connect(url, { token: "secret", worker: false });
  const stream: MeshStream = await client.subscribeMesh({ encoding: Encoding.U16_DELTA, motions: true });
  stream.on("frame", (frame: BodyFrame) => console.log(frame.vertices.length, frame.poseSequence + 1n));
  const skinner = new GpuSkinner(gl, stream.skinning!);
  // @ts-expect-error a pose has rotations
  client.setPose({ turns: [] });
  return skinner.skinning.vertexCount;
}
