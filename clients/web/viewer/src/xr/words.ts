// SPDX-License-Identifier: Apache-2.0
// Words within the scene: the page's own cannot be seen from inside a headset.
import * as THREE from "three";

const PIXELS = 44;
const PAD = 22;

/** White on dark, in the page's own type; read before any room. */
function draw(texture: THREE.CanvasTexture<HTMLCanvasElement>, lines: readonly string[]): number {
  const canvas = texture.image, context = canvas.getContext("2d")!;
  const font = `600 ${PIXELS}px ${getComputedStyle(document.body).fontFamily || "sans-serif"}`;
  context.font = font;
  canvas.width = Math.ceil(Math.max(...lines.map((line) => context.measureText(line).width))) + 2 * PAD;
  canvas.height = Math.ceil(lines.length * PIXELS * 1.3) + PAD;
  Object.assign(context, { font, textBaseline: "middle", fillStyle: "rgba(16, 20, 26, 0.86)" });
  context.beginPath();
  context.roundRect(0, 0, canvas.width, canvas.height, PAD);
  context.fill();
  context.fillStyle = "#ffffff";
  lines.forEach((line, row) => context.fillText(line, PAD, PAD / 2 + PIXELS * 1.3 * (row + 0.5)));
  // Another size is another texture.
  texture.dispose();
  texture.needsUpdate = true;
  return canvas.width / canvas.height;
}

const newTexture = () => Object.assign(new THREE.CanvasTexture(document.createElement("canvas")), { colorSpace: THREE.SRGBColorSpace });

/** Turned to whoever looks, and equally large from near and far: `height` of a line is the share of what is seen at 1 m, m. */
export class Label {
  readonly sprite: THREE.Sprite;
  text = "";
  #texture = newTexture();

  constructor(private readonly height = 0.034) {
    this.sprite = new THREE.Sprite(new THREE.SpriteMaterial({
      map: this.#texture, sizeAttenuation: false, depthTest: false, depthWrite: false, transparent: true, toneMapped: false, fog: false,
    }));
    this.sprite.renderOrder = 200;
    this.sprite.visible = false;
  }

  /** Empty: nothing. */
  show(text: string): void {
    this.sprite.visible = text !== "";
    if (text === this.text) return;
    this.text = text;
    if (!text) return;
    const lines = text.split("\n");
    const height = this.height * lines.length;
    this.sprite.scale.set(height * draw(this.#texture, lines), height, 1);
  }

  at(point: THREE.Vector3): this {
    this.sprite.position.copy(point);
    return this;
  }

  dispose(): void {
    this.#texture.dispose();
    this.sprite.material.dispose();
  }
}

/** Lies on the floor, read from where its lower edge is. */
export class Plate {
  readonly mesh: THREE.Mesh<THREE.PlaneGeometry, THREE.MeshBasicMaterial>;
  #texture = newTexture();
  #text = "";

  constructor(private readonly lineHeight: number) {
    this.mesh = new THREE.Mesh(new THREE.PlaneGeometry(1, 1).rotateX(-Math.PI / 2),
      new THREE.MeshBasicMaterial({ map: this.#texture, transparent: true, depthWrite: false, toneMapped: false }));
    this.mesh.renderOrder = -10;
  }

  show(text: string): void {
    if (text === this.#text) return;
    this.#text = text;
    const lines = text.split("\n"), height = this.lineHeight * lines.length;
    this.mesh.scale.set(height * draw(this.#texture, lines), 1, height);
  }

  dispose(): void {
    this.#texture.dispose();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}
