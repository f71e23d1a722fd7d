// SPDX-License-Identifier: Apache-2.0
/** Whether WebAssembly may be compiled here: a page's policy can forbid it, and some browsers' lockdown. */
export function compilesWebAssembly(): boolean {
  try {
    new WebAssembly.Module(Uint8Array.of(0, 0x61, 0x73, 0x6d, 1, 0, 0, 0));  // an empty one
    return true;
  } catch {
    return false;
  }
}
