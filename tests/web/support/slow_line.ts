// SPDX-License-Identifier: Apache-2.0
// A line that takes so many bytes a second from the server and no more: it reads no faster than it writes, so that the server's own
// queues fill.
import net from "node:net";

const TICK_MS = 20;

export class SlowLine {
  /** Infinity: as fast as loopback. */
  bytesPerSecond = Infinity;
  private readonly pairs = new Set<net.Socket>();

  private constructor(private readonly server: net.Server, readonly port: number) {}

  static async start(backend: () => number): Promise<SlowLine> {
    const server = net.createServer({ noDelay: true });
    await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
    const line = new SlowLine(server, (server.address() as net.AddressInfo).port);
    server.on("connection", (socket) => line.carry(socket, net.connect({ port: backend(), host: "127.0.0.1", noDelay: true })));
    return line;
  }

  stop(): void {
    for (const socket of this.pairs) socket.destroy();
    this.server.close();
  }

  private carry(client: net.Socket, server: net.Socket): void {
    client.pipe(server);
    let allowance = 0;
    const send = () => {
      for (;;) {
        const bytes = server.read(Math.max(1, Math.min(allowance, server.readableLength))) as Buffer | null;
        if (allowance < 1 || !bytes) return void (bytes && server.unshift(bytes));
        allowance -= bytes.length;
        client.write(bytes);
      }
    };
    const timer = setInterval(() => {
      allowance = Math.min(this.bytesPerSecond, 1e9) * (TICK_MS / 1000) + Math.min(allowance, 0);
      send();
    }, TICK_MS);
    server.on("readable", () => { if (this.bytesPerSecond === Infinity) { allowance = 1e9; send(); } });
    for (const [one, other] of [[client, server], [server, client]] as const) {
      this.pairs.add(one);
      one.on("error", () => other.destroy());
      one.on("close", () => { clearInterval(timer); this.pairs.delete(one); other.destroy(); });
    }
  }
}
