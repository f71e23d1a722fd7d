// SPDX-License-Identifier: Apache-2.0
// A WebSocket in a thread of its own, as the client has one: hands on each message as it comes, and looks at none.
const socket = new WebSocket(new URLSearchParams(location.search).get("server")!);
socket.binaryType = "arraybuffer";
socket.onopen = () => postMessage(null);
socket.onmessage = ({ data }: MessageEvent<ArrayBuffer>) => postMessage(data, { transfer: [data] });
onmessage = () => socket.send("next");
