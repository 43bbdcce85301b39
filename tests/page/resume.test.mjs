// Resume with the states and requests of the daemon itself. Run by tests/page/run.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { PATIENCE, clickStop, startLoop, stateIs, textIs } from "./actions.mjs";
import { Daemon, browser, openPage } from "./daemon.mjs";

const DESK = { width: 1400, height: 900 };

const daemon = new Daemon();
let chrome;

before(async () => {
  await daemon.start();
  chrome = await browser();
});

after(async () => {
  await chrome?.close();
  await daemon.end();
  daemon.remove();
});

test("a command that waits does not start after STOP, and starts after Resume", async () => {
  const page = await openPage(chrome, daemon.url, DESK), viewer = await openPage(chrome, daemon.url, DESK);
  await startLoop(page);
  await page.click("#start"); // the same once more: it waits
  await daemon.until((state) => state.queue.length === 1);
  await clickStop(viewer);
  for (const each of [page, viewer]) {
    await each.waitForSelector("#held:not([hidden])", PATIENCE);
    await stateIs(each, "disarmed");
    await textIs(each, "held-waiting", "^1 command waits");
    assert.match(await each.textContent("#held-cause"), /^Stopped at \d\d:\d\d:\d\d/);
  }
  assert.ok(await viewer.isDisabled("#resume"), "it has no lease");
  const { queue } = await daemon.get("/state");
  assert.equal(queue[0].phase, "held");
  await page.click("#resume");
  await stateIs(page, "running");
  assert.ok(await viewer.isHidden("#held"));
  await clickStop(viewer);
  await stateIs(page, "disarmed");
});
