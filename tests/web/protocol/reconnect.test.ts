// SPDX-License-Identifier: Apache-2.0
// A client that loses its connection comes back by itself: to its place, or, where the server is a new one, to the same model, session,
// streams and pose.
import assert from "node:assert/strict";
import fs from "node:fs";
import net from "node:net";
import os from "node:os";
import path from "node:path";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { retryDelay } from "../../../clients/web/protocol/src/backoff.js";
import { Client, ConnectionError, Encoding, ReloadModelSchema, Role, ServerError, type BodyFrame, type ConnectionState, type MeshStream } from "../../../clients/web/protocol/src/index.js";
import { bendingPose } from "../support/poses.js";
import { Server, within } from "../support/server.js";

const stateOf = (client: Client, wanted: ConnectionState): Promise<string> => within(30, new Promise((resolve) => {
  const off = client.on("state", ({ state, reason }) => {
    if (state === wanted) { off(); resolve(reason); }
  });
}), wanted);

const frameOf = (stream: MeshStream, accept: (frame: BodyFrame) => boolean): Promise<BodyFrame> => within(30, new Promise((resolve) => {
  const off = stream.on("frame", (frame) => {
    if (accept(frame)) { off(); resolve({ ...frame, vertices: frame.vertices.slice() }); }
  });
}), "a frame");

/** Between client and server: `cut` breaks what runs through it. */
async function proxy(to: number): Promise<{ url: string; cut(): void; close(): void }> {
  const sockets = new Set<net.Socket>();
  const server = net.createServer((near) => {
    const far = net.connect(to, "127.0.0.1");
    for (const [one, other] of [[near, far], [far, near]]) {
      sockets.add(one);
      one.on("error", () => other.destroy()).on("close", () => other.destroy()).pipe(other);
    }
  });
  await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
  const cut = () => { for (const socket of sockets) socket.destroy(); sockets.clear(); };
  return { url: `ws://127.0.0.1:${(server.address() as net.AddressInfo).port}/v1`, cut, close: () => { server.close(); cut(); } };
}

test("a cut line: back at its place, with control, and a pose that was set meanwhile is shown", async (t) => {
  const server = await Server.start();
  t.after(() => server.stop());
  const line = await proxy(server.httpPort);
  t.after(() => line.close());
  const client = await within(20, Client.connect(line.url), "connecting");
  t.after(() => client.close());
  const model = await client.open();
  const stream = await client.subscribeMesh({ encoding: Encoding.U16_DELTA });
  const bent = frameOf(stream, ({ poseSequence }) => poseSequence === 1n);
  client.setPose(bendingPose(model, 0.3));
  await bent;

  let opened = 0;
  client.on("opened", () => ++opened);
  const reconnecting = stateOf(client, "reconnecting"), open = stateOf(client, "open");
  const before = client.hello.connection;
  line.cut();
  await reconnecting;
  const request = client.listClips();
  await assert.rejects(request, ConnectionError);
  const later = frameOf(stream, ({ poseSequence }) => poseSequence === 2n);
  client.setPose(bendingPose(model, 0.6));
  await open;
  await later;
  assert.ok(client.hello.resumed, "resumed");
  assert.notEqual(client.hello.connection, before);
  assert.equal(opened, 0);
  assert.equal(client.control.role, Role.CONTROLLER);
});

test("a new server on the same port: the same model, session, streams and pose", async (t) => {
  let server = await Server.start();
  t.after(() => server.stop());
  const client = await within(20, Client.connect(server.url), "connecting");
  t.after(() => client.close());
  const model = await client.open("", "healing");
  const stream = await client.subscribeMesh({ encoding: Encoding.U16_DELTA });
  const rest = stream.latest ?? await frameOf(stream, () => true);
  const bent = frameOf(stream, ({ poseSequence }) => poseSequence === 1n);
  client.setPose(bendingPose(model, 0.5));
  const expected = await bent;
  assert.notDeepEqual(expected.vertices, rest.vertices);

  const reconnecting = stateOf(client, "reconnecting"), open = stateOf(client, "open");
  const { port, httpPort } = server;
  await server.stop();
  assert.match(await reconnecting, /stop/);
  const again = frameOf(stream, ({ poseSequence }) => poseSequence === 1n);
  server = await Server.start([], { port, httpPort });
  await open;
  const found = await again;
  assert.equal(client.hello.resumed, undefined);
  assert.equal(client.model!.session, "healing");
  assert.deepEqual(found.vertices, expected.vertices);
});

test("a model that is replaced while it is open: told, and shown until it is opened anew", async (t) => {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "ecorche-replaced-")), file = path.join(folder, "body.hdf");
  t.after(() => fs.rmSync(folder, { recursive: true }));
  const [first, second] = [process.env["ECORCHE_MODEL"]!, process.env["ECORCHE_MODELS"]!.split(":").at(-1)!];
  fs.copyFileSync(first, file);
  const server = await Server.start([], { model: file });
  t.after(() => server.stop());
  const client = await within(20, Client.connect(server.url), "connecting");
  t.after(() => client.close());
  const model = await client.open("", "kept"), before = (await client.listModels())[0]!.identity;
  const stream = await client.subscribeMesh({ encoding: Encoding.U16_DELTA });

  const changed = within(60, new Promise<{ identity: bigint }>((resolve) => { client.on("modelChanged", resolve); }), "modelChanged");
  fs.copyFileSync(second, `${file}.new`);
  fs.renameSync(`${file}.new`, file);
  await client.ask({ case: "reloadModel", value: create(ReloadModelSchema, { model: model.model }) }, "status");
  const { identity } = await changed;
  assert.notEqual(identity, before);
  assert.equal((await client.listModels())[0]!.identity, identity);
  // The session goes on with what it has.
  const bend = async () => {
    const bent = frameOf(stream, ({ poseSequence }) => poseSequence === 1n);
    client.setPose(bendingPose(model, 0.4));
    return bent;
  };
  const old = await bend();
  assert.equal(client.model, model);

  // Nobody joins it any more: by the same name there is a new one, which shows the scan.
  const anew = frameOf(stream, ({ poseSequence }) => poseSequence === 0n);
  assert.equal((await client.open("", "kept")).lastSequence, 0n);
  await anew;
  const bent = await bend();
  assert.equal(bent.vertices.length, old.vertices.length);
  assert.notDeepEqual(bent.vertices, old.vertices, "other tets");
});

test("who may not come in is told once, and does not try again", async (t) => {
  const closed = net.createServer();
  await new Promise<void>((resolve) => closed.listen(0, "127.0.0.1", resolve));
  const { port } = closed.address() as net.AddressInfo;
  closed.close();
  await assert.rejects(within(20, Client.connect(`ws://127.0.0.1:${port}/v1`), "connecting"), ConnectionError);

  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "ecorche-token-")), file = path.join(folder, "token");
  t.after(() => fs.rmSync(folder, { recursive: true }));
  fs.writeFileSync(file, "open-sesame-of-forty\n");
  const server = await Server.start(["--token-file", file]);
  t.after(() => server.stop());
  const states: string[] = [];
  const onState = ({ state }: { state: string }) => states.push(state);
  await assert.rejects(within(20, Client.connect(server.url, { token: "open-barley", onState }), "connecting"),
    (error: ServerError) => error instanceof ServerError && error.code === 16);
  assert.deepEqual(states, ["connecting", "closed"]);
  const client = await within(20, Client.connect(server.url, { token: "open-sesame-of-forty" }), "connecting");
  client.close();
});

test("tries come later and later, spread at random, and not before a server wants them", () => {
  assert.ok(retryDelay(0, 0, 0) >= 100 && retryDelay(0, 0, 1) <= 500);
  for (let tries = 1; tries < 40; ++tries) {
    assert.ok(retryDelay(tries, 0, 1) >= retryDelay(tries - 1, 0, 1));
    assert.ok(retryDelay(tries, 0, 1) <= 15_000);
    assert.ok(retryDelay(tries, 0, 0) < retryDelay(tries, 0, 1));
  }
  assert.equal(retryDelay(0, 3, 0), 3000);
  assert.equal(retryDelay(0, 3, 1), 6000);
});
