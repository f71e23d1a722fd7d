// SPDX-License-Identifier: Apache-2.0
// One line of JSON a model: from the address to the first picture of the body, and to that of all of it, in the viewer that `ecorche serve` holds. Run by `run`.
import { launch } from "../../tests/web/support/page.js";
import { Server } from "../../tests/web/support/server.js";

const [runs, ...models] = process.argv.slice(2);
const marks = ["connected", "opened", "frame", "body"], names = [...marks, "whole"];
const median = (values: number[]) => values.sort((a, b) => a - b)[values.length >> 1]!;

const browser = await launch();
try {
  for (const model of models) {
    const server = await Server.start([], { model });
    try {
      const seconds = names.map((): number[] => []);
      for (let run = 0; run < Number(runs); ++run) {
        const context = await browser.newContext({ viewport: { width: 1280, height: 720 } });
        const page = await context.newPage();
        await page.goto(`http://127.0.0.1:${server.httpPort}/`);
        await page.waitForFunction(() => performance.getEntriesByName("ecorche body").length > 0, undefined, { timeout: 90_000 });
        // Its finest level is drawn: the next picture after it came.
        const whole = await page.evaluate(async () => {
          const { live, stage } = (window as any).ecorche;
          while (live.frame.level !== 0) await new Promise(requestAnimationFrame);
          return new Promise<number>((resolve) => { stage.onAfterDraw(() => resolve(performance.now() / 1000)); stage.invalidate(); });
        });
        const times = await page.evaluate((names) => names.map((name) => performance.getEntriesByName(`ecorche ${name}`)[0]!.startTime / 1000), marks);
        [...times, whole].forEach((time, i) => seconds[i]!.push(time));
        await context.close();
      }
      console.log(JSON.stringify({ model, ...Object.fromEntries(names.map((name, i) => [name, median(seconds[i]!)])), worst: Math.max(...seconds[marks.length - 1]!) }));
    } finally {
      await server.stop();
    }
  }
} finally {
  await browser.close();
}
