// SPDX-License-Identifier: Apache-2.0
// The body as it is in the picture, small: from in front of the camera's side, filled, without rings and dots.
import * as THREE from "three";
import type { App } from "../app.js";

/** A JPEG in base64. `width` and `height` in pixels of CSS: it has twice as many. */
export function thumbnail(app: App, width: number, height: number): string {
  const { stage, body } = app;
  const box = body.bounds();
  const camera = new THREE.PerspectiveCamera(24, width / height, 0.05, 60);
  const center = box.getCenter(new THREE.Vector3()).applyMatrix4(stage.patient.matrix);
  const direction = stage.camera.getWorldDirection(new THREE.Vector3()).negate();
  // The ball about the body lies within the picture, whatever way it is turned.
  const radius = box.getSize(new THREE.Vector3()).length() / 2000;
  const half = Math.atan(Math.tan(THREE.MathUtils.degToRad(12)) * Math.min(1, width / height));
  camera.position.copy(center).addScaledVector(direction, 0.86 * radius / Math.sin(half));
  camera.lookAt(center);
  const { renderer } = stage;
  const hidden = stage.patient.children.filter((child) => child !== body.group && child.visible);
  for (const child of hidden) child.visible = false;
  const size = renderer.getSize(new THREE.Vector2()), ratio = renderer.getPixelRatio();
  const canvas = document.createElement("canvas");
  canvas.width = 2 * width;
  canvas.height = 2 * height;
  try {
    renderer.setPixelRatio(1);
    renderer.setSize(canvas.width, canvas.height, false);
    renderer.render(stage.scene, camera);
    // Before anything else is drawn: the picture is gone with this turn.
    canvas.getContext("2d")!.drawImage(renderer.domElement, 0, 0);
  } finally {
    renderer.setPixelRatio(ratio);
    renderer.setSize(size.x, size.y, false);
    for (const child of hidden) child.visible = true;
    stage.render();
  }
  return canvas.toDataURL("image/jpeg", 0.82).split(",")[1]!;
}
