// What the live page shows of a bench that is held. The states are those of a daemon on the simulated stage with additions, so that
// each case is exact. Run by tests/page/run.

import assert from "node:assert/strict";
import { after, afterEach, before, test } from "node:test";
import { PATIENCE, takeLease, textIs } from "./actions.mjs";
import { Daemon, browser, openPage } from "./daemon.mjs";
import { TRIP, waiting } from "./mock.mjs";

const DESK = { width: 1400, height: 900 };
/** 2026-11-26 10:20:30 in the time of this machine, which is that of the browser. */
const SINCE_UNIX_S = new Date(2026, 10, 26, 10, 20, 30).getTime() / 1000;
const STOPPED = { cause: "stop", by: "anna", since_unix_s: SINCE_UNIX_S, how: "settle", run: 7 };

const daemon = new Daemon();
let chrome;

before(async () => {
  await daemon.start();
  chrome = await browser();
});

afterEach(async () => { for (const context of chrome.contexts()) await context.close(); });

after(async () => {
  await chrome?.close();
  await daemon.end();
  daemon.remove();
});

const open = (change) => openPage(chrome, daemon.url, DESK, "light", { change });
const isHeld = (page) => page.waitForSelector("#held:not([hidden])", PATIENCE);

test("shows who stopped the bench, when and how, and how many commands wait", async () => {
  const page = await open((state) => Object.assign(state, { held: STOPPED, queue: [waiting(8, "held"), waiting(9, "held")] }));
  await isHeld(page);
  assert.ok(await page.isVisible("#held-badge"));
  assert.match(await page.textContent("#held-cause"), /^Stopped (on 2026-11-26 )?at 10:20:30 in run 7 by anna, the run settled\.$/);
  assert.match(await page.textContent("#held-waiting"), /^2 commands wait/);
  assert.match(await page.textContent("#queue"), /chirp of bob, held/);
  assert.deepEqual(page.faults, []);
});

test("shows a trip with its remedy until it is acknowledged", async () => {
  let trip = TRIP;
  const page = await open((state) => Object.assign(state, { held: { ...STOPPED, cause: "trip", by: TRIP.text, how: null }, trip }));
  await isHeld(page);
  assert.match(await page.textContent("#held-cause"), /^Tripped .*in run 7: travel of 1.02 mm exceeds/);
  assert.match(await page.textContent("#held-waiting"), /^No command waits/);
  assert.match(await page.textContent("#alert"), /travel of 1.02 mm.*Remedy: move the stage to its middle/);
  trip = null;
  await page.waitForSelector("#alert", { ...PATIENCE, state: "hidden" });
  assert.ok(await page.isVisible("#held"), "an acknowledged trip still holds");
});

test("Resume needs the lease of this page and says so", async () => {
  let lease = null;
  const page = await open((state) => { state.held = STOPPED; state.lease ??= lease; });
  await isHeld(page);
  assert.ok(await page.isDisabled("#resume"));
  await textIs(page, "resume-why", "take it first");
  lease = { operator: "bob", since_unix_s: 0, expires_in_s: 10 };
  await textIs(page, "resume-why", "which bob holds");
  assert.ok(await page.isDisabled("#resume"));
});

test("Resume sends the lease and the token, and shows a refusal beside it", async () => {
  let held = STOPPED, answer = { status: 409, json: { error: { message: "the trip is not acknowledged" } } };
  const page = await open((state) => { state.held = held; });
  const requests = [];
  await page.route("**/api/v1/resume", (route) => {
    requests.push(route.request());
    return route.fulfill(answer);
  });
  await isHeld(page);
  await takeLease(page);
  await page.click("#resume");
  await textIs(page, "resume-error", "the trip is not acknowledged");
  answer = { status: 204 };
  await page.click("#resume");
  await textIs(page, "resume-error", "^$");
  held = null;
  await page.waitForSelector("#held", { ...PATIENCE, state: "hidden" });
  assert.ok(await page.isHidden("#held-badge"));
  for (const request of requests) {
    assert.equal(request.method(), "POST");
    assert.match(request.headers().authorization, /^Bearer \w+/);
    assert.match(request.headers()["bench-lease"], /./);
  }
  assert.equal(requests.length, 2);
});

test("a daemon whose state has no `held` holds nothing", async () => {
  const page = await open((state) => { delete state.held; });
  await textIs(page, "state", "disarmed");
  assert.ok(await page.isHidden("#held"));
  assert.ok(await page.isHidden("#held-badge"));
  assert.deepEqual(page.faults, []);
});

test("while the bench is held a space is typed into a text field, although commands wait", async () => {
  const page = await open((state) => Object.assign(state, { held: STOPPED, queue: [waiting(8, "held")] }));
  await isHeld(page);
  await page.focus("#run-note");
  await page.keyboard.type("a note");
  assert.equal(await page.inputValue("#run-note"), "a note");
});

test("while a command waits and the bench is not held, the space bar stops in a text field too", async () => {
  const page = await open((state) => Object.assign(state, { held: null, queue: [waiting(8, "queued")] }));
  await textIs(page, "queue", "chirp");
  const stopped = page.waitForRequest("**/api/v1/stop", PATIENCE);
  await page.focus("#run-note");
  await page.keyboard.press(" ");
  await stopped;
  assert.equal(await page.inputValue("#run-note"), "");
});

test("a run that only computes lets a space be typed", async () => {
  const page = await open((state) => Object.assign(state, { run: { ...waiting(8, "analysing"), progress: null } }));
  await textIs(page, "progress-text", "analysing");
  await page.focus("#run-note");
  await page.keyboard.type("a b");
  assert.equal(await page.inputValue("#run-note"), "a b");
});
