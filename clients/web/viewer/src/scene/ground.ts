// SPDX-License-Identifier: Apache-2.0
// What the body stands before and upon: a calm backdrop, and a soft shadow where it meets the ground.
import * as THREE from "three";

export function backdrop() {
  const material = new THREE.ShaderMaterial({
    depthTest: false, depthWrite: false, toneMapped: false,
    uniforms: { above: { value: new THREE.Color() }, below: { value: new THREE.Color() } },
    vertexShader: "varying vec2 at; void main() { at = position.xy; gl_Position = vec4(position.xy, 1.0, 1.0); }",
    // A light behind the body that falls off to the corners; the noise of half a step keeps the gradient from banding.
    fragmentShader: /* glsl */ `
      #include <common>
      uniform vec3 above, below;
      varying vec2 at;
      void main() {
        float fall = smoothstep(0.15, 1.5, length((at - vec2(0.0, 0.12)) * vec2(0.85, 1.0)));
        vec3 color = mix(above, below, fall);
        gl_FragColor = vec4(color, 1.0);
        #include <colorspace_fragment>
        gl_FragColor.rgb += (rand(gl_FragCoord.xy) - 0.5) / 255.0;
      }`,
  });
  const mesh = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material);
  mesh.frustumCulled = false;
  mesh.renderOrder = -100;
  return {
    mesh,
    setColors(above: number, below: number) {
      material.uniforms["above"]!.value.set(above);
      material.uniforms["below"]!.value.set(below);
    },
  };
}

export function ground() {
  const material = new THREE.ShaderMaterial({
    transparent: true, depthWrite: false, toneMapped: false, side: THREE.DoubleSide,
    uniforms: { shadow: { value: new THREE.Color() } },
    vertexShader: "varying vec2 at; void main() { at = uv * 2.0 - 1.0; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }",
    fragmentShader: /* glsl */ `
      uniform vec3 shadow;
      varying vec2 at;
      void main() {
        float far = length(at);
        float contact = exp(-far * far * 14.0) * 0.34, wide = exp(-far * far * 4.0) * 0.26;
        gl_FragColor = vec4(shadow, (contact + wide) * (1.0 - smoothstep(0.75, 1.0, far)));
        #include <colorspace_fragment>
      }`,
  });
  const mesh = new THREE.Mesh(new THREE.PlaneGeometry(2, 2).rotateX(-Math.PI / 2), material);
  mesh.renderOrder = -50;
  mesh.visible = false;
  return {
    mesh,
    setColor(shadow: number) {
      material.uniforms["shadow"]!.value.set(shadow);
    },
    place(x: number, floor: number, z: number, radius: number) {
      mesh.position.set(x, floor, z);
      mesh.scale.setScalar(radius);
    },
  };
}
