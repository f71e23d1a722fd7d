// SPDX-License-Identifier: Apache-2.0
// The posed volume of the present pose as a file, fetched once and packed in the page.
import { fetchVolume, gridOf, type VolumeShown } from "../../../protocol/src/index.js";
import type { App } from "../app.js";
import { wordsOf } from "../errors.js";
import { showJob } from "../panels/job.js";
import { download } from "../panels/save.js";
import { writeNifti } from "./nifti.js";

/** Beyond, a page may lose its memory while it packs. */
const MOST_BYTES = 1 << 30;

export async function saveVolume(app: App, name: string, bySpheres = false): Promise<void> {
  const { client } = app.live, volume = client?.model?.volumes.find((each) => each.name === name);
  if (!client || !volume) return app.say(`The model holds no volume ${name}`);
  const abort = new AbortController();
  const job = showJob(app, `Posed volume ${name}`, () => abort.abort(new DOMException("cancelled", "AbortError")));
  try {
    const { size } = gridOf(volume.grid), at = size[0] * size[1] * size[2];
    if (at > MOST_BYTES) throw new Error(`${at} voxels are too many for a page (\`ecorche pose\` writes them)`);
    job.say("Posing on the server");
    const { image, poseSequence }: VolumeShown = await fetchVolume(client, { volume: name, bySpheres }, app.store.state.poseSequence, abort.signal);
    if (image.voxels.byteLength > MOST_BYTES) throw new Error(`${image.voxels.byteLength} bytes are too many for a page (\`ecorche pose\` writes them)`);
    job.say("Packing");
    const blob = await writeNifti(image, (share) => job.progress(share), abort.signal);
    download(blob, `${client.model!.model}_${name}_pose_${poseSequence}${bySpheres ? "_by_balls" : ""}.nii.gz`);
    app.say(`Saved ${name}, ${image.grid.size.join(" x ")} voxels`);
  } catch (error) {
    app.say(abort.signal.aborted ? `${name} was not saved: cancelled` : `${name} was not saved: ${wordsOf(error)}`);
  } finally {
    job.end();
  }
}
