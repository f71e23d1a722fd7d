// SPDX-License-Identifier: Apache-2.0
// Whether the body can be shown in a headset or in the room, and if not, why: in words for a person.
import { wordsOf } from "../errors.js";

export type Mode = "immersive-vr" | "immersive-ar";

/** Empty where sessions of this mode are on offer. */
export async function whyNot(mode: Mode): Promise<string> {
  // Browsers hide WebXR from pages that came over plain http.
  if (!isSecureContext) return "Headsets are only for pages that come by https or from localhost. Open this page so.";
  if (!navigator.xr) return "This browser has no WebXR. Chrome, Edge and the browsers of headsets have it.";
  try {
    if (await navigator.xr.isSessionSupported(mode)) return "";
  } catch (error) {
    return `The browser does not let this page use headsets: ${wordsOf(error)}`;
  }
  return mode === "immersive-vr" ? "No headset is there. Connect one and start its software, or open this page in the headset's own browser."
    : "This device shows nothing within the room. A headset with cameras does, and an Android phone with ARCore.";
}

/** Why a session did not begin. */
export function refusal(error: unknown): string {
  const name = error instanceof DOMException ? error.name : "";
  if (name === "NotAllowedError" || name === "SecurityError") return "it was not allowed. Allow this page to use the headset in the browser's settings of this page.";
  if (name === "NotSupportedError") return "the headset lacks what is needed, a floor to stand on. Set up its boundary, then try again.";
  if (name === "InvalidStateError") return "another page or window holds the headset. Leave it there first.";
  return wordsOf(error);
}
