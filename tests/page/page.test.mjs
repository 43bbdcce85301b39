// The live page in a headless browser. Run by tests/page/run.

import assert from "node:assert/strict";
import { createRequire } from "node:module";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { after, afterEach, before, test } from "node:test";
import { Daemon, browser, openPage } from "./daemon.mjs";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const PICTURES = process.env.BENCH_PAGE_PICTURES ?? "target/page-pictures";
const SCOPE_S = Number(process.env.BENCH_PAGE_SCOPE_S ?? 60);
const DESK = { width: 1400, height: 1000 };
/** A step that waits longer than this has failed. It is not a requirement. */
const PATIENCE = { timeout: 180_000 };

const daemon = new Daemon();
let chrome;

before(async () => {
  mkdirSync(PICTURES, { recursive: true });
  await daemon.start();
  chrome = await browser();
});

after(async () => {
  await chrome?.close();
  await daemon.end();
  daemon.remove();
});

// A test that fails leaves no page, no lease and no run to the next one.
afterEach(async () => {
  for (const context of chrome.contexts()) await context.close();
  await daemon.cut().catch(() => {}); // a test may have ended the daemon
});

const stateIs = (page, wanted) => page.waitForFunction((wanted) => document.getElementById("state").textContent === wanted, wanted, PATIENCE);
const planSays = (page, pattern) => page.waitForFunction((pattern) => new RegExp(pattern).test(document.getElementById("plan-text").textContent), pattern, PATIENCE);
const median = (values) => values.toSorted((one, other) => one - other)[Math.floor(values.length / 2)];

/** A picture of the whole page, which its bar covers nowhere but at the top. */
async function picture(page, name) {
  await page.evaluate(() => scrollTo(0, 0));
  await page.screenshot({ path: `${PICTURES}/${name}.png`, fullPage: true });
}

async function violations(page) {
  await page.evaluate(AXE);
  const found = await page.evaluate(() => axe.run(document, { resultTypes: ["violations"] }));
  return found.violations.map((violation) => `${violation.id}: ${violation.nodes.map((node) => node.target.join(" ")).join(", ")}`);
}

test("every control does its work", async () => {
  const page = await openPage(chrome, daemon.url, DESK);
  const used = new Set();
  /** Uses a control and notes it. */
  const use = async (id, action) => { used.add(id); await action(page.locator(`#${id}`)); };
  const choose = (id, value) => use(id, (control) => control.selectOption(value));
  const fill = (id, value) => use(id, (control) => control.fill(value));
  const click = (id) => use(id, (control) => control.click());
  await stateIs(page, "disarmed");

  // The lease: refused without a name, then taken.
  await click("lease-button");
  await page.click("#name-dialog button[value=cancel]");
  await click("lease-button");
  await fill("operator", "anna");
  await page.click("#name-dialog button[value=ok]");
  await page.waitForFunction(() => document.getElementById("lease-text").textContent.includes("anna"), null, PATIENCE);

  // A sine in closed loop: start is possible after the plan only.
  await choose("command", "control");
  await choose("controller", "slow");
  await choose("reference", "sine");
  await fill("amplitude", "30um");
  await fill("frequency", "2Hz");
  await fill("duration", "300s");
  await fill("run-name", "first");
  await fill("run-note", "note of anna");
  await choose("on-disconnect", "stop");
  assert.ok(await page.isDisabled("#start"), "no start without a plan");
  await fill("certificate", "missing_certificate.json");
  await click("plan");
  await planSays(page, "missing_certificate.json: cannot read the file");
  await fill("certificate", "");
  await click("plan");
  await planSays(page, "Travel.*Current.*Duration");
  await click("start");
  await stateIs(page, "running");
  await page.waitForSelector("#progress-box:not(.is-empty)", PATIENCE);
  used.add("progress");

  // The scope.
  await choose("span", "0.5");
  await click("cursors");
  assert.match(await page.textContent("#scope-readout"), /between the cursors/);
  await click("cursors");
  await choose("trigger", "position");
  await fill("level", "5");
  await page.waitForFunction(() => document.getElementById("pause").textContent === "Follow", null, PATIENCE);
  await choose("trigger", "none");
  await click("pause");
  await use("scope", async (scope) => {
    await scope.focus();
    await page.keyboard.press("ArrowLeft");
    assert.equal(await page.textContent("#pause"), "Follow", "scrolling back pauses");
    await page.keyboard.press("+");
    await page.keyboard.press("-");
    await page.keyboard.press("0");
    assert.equal(await page.textContent("#pause"), "Pause", "0 follows again");
    await scope.hover({ position: { x: 500, y: 100 } });
    await page.waitForFunction(() => / s: reference/.test(document.getElementById("scope-readout").textContent), null, PATIENCE);
    await page.mouse.wheel(0, -200);
  });

  // The spectrum of the error, with zoom and cursor.
  await page.waitForSelector("#spectrum:not(.is-empty)", PATIENCE);
  await use("spectrum", async (spectrum) => {
    await page.mouse.move(0, 0); // a page that scrolls below the pointer moves the cursor
    await spectrum.focus();
    for (const key of ["+", "ArrowRight", "-", "ArrowLeft"]) await page.keyboard.press(key);
    await page.waitForFunction(() => /Hz: .*sqrt/.test(document.getElementById("spectrum-readout").textContent), null, PATIENCE);
    await page.keyboard.press("0");
  });

  // Tuning: a gain far beyond the margins is refused, a smaller reference accepted.
  await fill("tune-gain", "9");
  await click("tune-apply");
  await page.waitForFunction(() => /margin|unstable/.test(document.getElementById("tune-text").textContent), null, PATIENCE);
  await fill("tune-gain", "1");
  await fill("tune-reference", "0.5");
  await click("tune-apply");
  await page.waitForFunction(() => /along a ramp/.test(document.getElementById("tune-text").textContent), null, PATIENCE);

  // The queue: a chirp waits behind the sine, with its length.
  await choose("command", "chirp");
  await fill("from", "10Hz");
  await fill("to", "100Hz");
  await fill("amplitude", "0.1A");
  await fill("duration", "25s");
  await fill("run-name", "second");
  await click("plan");
  await planSays(page, "Travel");
  await click("start");
  await page.waitForFunction(() => /chirp.*queued.*about 3\d s/.test(document.getElementById("queue").textContent), null, PATIENCE);

  // Stop: the sine settles, the chirp has its turn and its response grows. The stop holds the bench until Resume.
  await click("stop");
  await planSays(page, "Run 1 ");
  await page.waitForSelector("#resume:not([disabled])", PATIENCE);
  await click("resume");
  await page.waitForFunction(() => /Run 2, chirp/.test(document.getElementById("progress-text").textContent), null, PATIENCE);
  await page.waitForSelector("#response-panel:not([hidden])", PATIENCE);
  await use("response", async (response) => {
    await page.mouse.move(0, 0); // a page that scrolls below the pointer moves the cursor
    await response.focus();
    for (const key of ["+", "ArrowRight", "-", "ArrowLeft"]) await page.keyboard.press(key);
    await page.waitForFunction(() => /um\/A.*deg/.test(document.getElementById("response-readout").textContent), null, PATIENCE);
    await page.keyboard.press("0");
  });
  await picture(page, "chirp");
  await planSays(page, "Run 2 ");
  const measured = (await daemon.get("/response")).frequency_hz;
  assert.ok(measured[0] < 12 && measured.at(-1) > 80, `${measured[0]} to ${measured.at(-1)} Hz`);

  // A step, and its page.
  await choose("command", "control");
  await choose("reference", "step");
  await fill("amplitude", "");
  await fill("duration", "2s");
  await click("plan");
  await planSays(page, "Travel");
  await click("start");
  await planSays(page, "Run 3 completed");
  const step = page.frameLocator("#result iframe");
  await step.locator("svg").first().waitFor(PATIENCE);
  assert.match(await step.locator("body").textContent(), /Settling to 2 %/);
  await page.locator("#result").screenshot({ path: `${PICTURES}/step.png` });

  // Recordings: show, note, compare, delete.
  const rows = page.locator("#recordings tr");
  assert.equal(await rows.count(), 3);
  const steps = rows.nth(0), sine = rows.nth(2);
  assert.match(await sine.textContent(), /first.*anna/s);
  // The selection survives the new list after the note.
  await steps.locator("input").check();
  await sine.getByRole("button", { name: "note" }).click();
  await fill("note-name", "renamed");
  await fill("note-text", "another note");
  await page.click("#note-dialog button[value=ok]");
  await page.waitForFunction(() => /renamed: another note/.test(document.getElementById("recordings").textContent), null, PATIENCE);
  await click("compare");
  await page.waitForFunction(() => /^Comparison/.test(document.querySelector("#result h3").textContent), null, PATIENCE);
  await page.frameLocator("#result iframe").locator("svg").first().waitFor(PATIENCE);
  await steps.getByRole("button", { name: "show" }).click();
  await steps.getByRole("button", { name: "delete" }).click();
  await page.click("#confirm-dialog button[value=cancel]");
  assert.equal(await rows.count(), 3, "cancelled");
  await steps.getByRole("button", { name: "delete" }).click();
  await page.click("#confirm-dialog button[value=ok]");
  await page.waitForFunction(() => document.querySelectorAll("#recordings tr").length === 2, null, PATIENCE);
  const download = page.waitForEvent("download");
  await page.locator("#recordings a").first().click();
  assert.match((await download).suggestedFilename(), /\.mcap$/);

  // The theme of the operator goes before that of the system.
  await choose("theme", "dark");
  assert.equal(await page.evaluate(() => getComputedStyle(document.body).colorScheme), "dark");
  await choose("theme", "auto");
  await click("lease-button");
  await page.waitForFunction(() => /free/.test(document.getElementById("lease-text").textContent), null, PATIENCE);

  const controls = await page.evaluate(() => [...document.querySelectorAll("button[id], select[id], input[id], textarea[id], canvas[tabindex]")].map((control) => control.id));
  const unused = controls.filter((id) => !used.has(id) && id !== "token");
  assert.deepEqual(unused, [], "controls without a test");
  assert.deepEqual(page.faults, ["422 /api/v1/plan", "422 /api/v1/tune"], "only the missing certificate and the gain are refused");
  await page.context().close();
});

test("without the token nothing changes, and the page asks for it", async () => {
  const page = await openPage(chrome, daemon.url.replace(/#.*/, ""), DESK);
  await stateIs(page, "disarmed");
  await page.click("#lease-button");
  await page.fill("#operator", "eve");
  await page.click("#name-dialog button[value=ok]");
  await page.waitForSelector("#token-dialog[open]", PATIENCE);
  assert.equal((await daemon.get("/state")).lease, null);
  await page.fill("#token", /token=(\w+)/.exec(daemon.url)[1]);
  await page.click("#token-dialog button[value=ok]");
  await page.waitForFunction(() => /eve/.test(document.getElementById("lease-text").textContent), null, PATIENCE);
  await page.click("#lease-button");
  assert.deepEqual(page.faults, ["401 /api/v1/lease"], "only the first attempt is refused");
  await page.context().close();
});

test("the keyboard alone starts and stops a loop", async () => {
  const page = await openPage(chrome, daemon.url, DESK);
  await stateIs(page, "disarmed");
  const focusOn = async (id) => {
    for (let step = 0; step < 80; step++) {
      if (await page.evaluate(() => document.activeElement.id) === id) return;
      await page.keyboard.press("Tab");
    }
    assert.fail(`${id} cannot be reached with Tab`);
  };
  await page.keyboard.press("l");
  await page.waitForSelector("#name-dialog[open]", PATIENCE);
  await page.keyboard.type("anna");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.getElementById("lease-text").textContent === "arm lease: anna (this page)", null, PATIENCE);
  if ((await daemon.get("/state")).held) { // by a test before this one
    await focusOn("resume");
    await page.keyboard.press("Enter");
    await page.waitForSelector("#held", { state: "hidden", ...PATIENCE });
  }
  await focusOn("plan");
  await page.keyboard.press("Enter");
  await planSays(page, "Travel");
  await focusOn("start");
  await page.keyboard.press("Enter");
  await stateIs(page, "running");
  await page.keyboard.press("p");
  assert.equal(await page.textContent("#pause"), "Follow");
  await page.keyboard.press(" ");
  await stateIs(page, "disarmed");
  await planSays(page, "stopped");
  await page.keyboard.press("l");
  await page.waitForFunction(() => /free/.test(document.getElementById("lease-text").textContent), null, PATIENCE);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

for (const [width, height] of [[390, 844], [1400, 1000], [2560, 1440]]) {
  for (const scheme of ["light", "dark"]) {
    test(`accessible and within its width at ${width} px, ${scheme}`, async () => {
      const page = await openPage(chrome, daemon.url, { width, height }, scheme);
      await stateIs(page, "disarmed");
      await page.locator("#recordings tr").last().getByRole("button", { name: "show" }).click();
      await page.waitForSelector("#result table", PATIENCE);
      assert.deepEqual(await violations(page), []);
      await page.keyboard.press("l");
      assert.deepEqual(await violations(page), []);
      await page.keyboard.press("Escape");
      const overflow = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
      assert.ok(overflow <= 0, `wider than the window by ${overflow} px`);
      await page.frameLocator("#result iframe").locator("svg").first().waitFor(PATIENCE);
      await picture(page, `${width}-${scheme}`);
      assert.deepEqual(page.faults, []);
      await page.context().close();
    });
  }
}

test("a spike of one tick is visible in ten minutes", async () => {
  const page = await openPage(chrome, daemon.url, DESK);
  const heights = await page.evaluate(async () => {
    const { Samples } = await import("/page/samples.js");
    const { Scope } = await import("/page/scope.js");
    const samples = new Samples(), perFrame = 250, periodS = 2e-4, spike = 1_234_567;
    for (let first = 0; first < 3_000_000; first += perFrame) {
      const buffer = new ArrayBuffer(32 + 4 * 4 * perFrame), view = new DataView(buffer);
      view.setUint8(0, 1); view.setUint8(1, 1); view.setUint16(2, 4, true); view.setUint32(4, 1, true);
      view.setFloat64(8, first * periodS, true); view.setFloat64(16, periodS, true); view.setUint32(24, perFrame, true);
      if (spike >= first && spike < first + perFrame) view.setFloat32(32 + 4 * (perFrame + spike - first), 1e-4, true);
      samples.add(buffer);
    }
    const canvas = document.createElement("canvas");
    canvas.style.cssText = "position: absolute; left: 0; top: 0; width: 1200px; height: 600px";
    document.body.append(canvas);
    const scope = new Scope(canvas, document.createElement("p"), samples);
    scope.spanS = 600;
    scope.draw();
    const { left, width } = scope.box;
    const at = Math.round(left + spike * periodS / 600 * width), context = canvas.getContext("2d");
    /** Rows of a column in which the position is drawn: its blue differs from the colours of frame and grid. */
    const rows = (x) => {
      const pixels = context.getImageData(x, 20, 1, 240).data;
      let count = 0;
      for (let row = 0; row < 240; row++) if (pixels[4 * row + 3] > 60 && pixels[4 * row + 2] - pixels[4 * row] > 60) count++;
      return count;
    };
    return { spike: Math.max(rows(at - 1), rows(at), rows(at + 1)), beside: Math.max(rows(at - 8), rows(at + 8)) };
  });
  assert.ok(heights.spike > 120 && heights.beside < 20, JSON.stringify(heights));
  await page.context().close();
});

test("no label of the scope is cut at its left edge", async () => {
  const page = await openPage(chrome, daemon.url, DESK);
  // Constant signals have the narrowest range, and so the longest labels.
  for (const value of [0, -1e-7, -1e-4, -1e-3, -0.0123456, 0.4]) {
    const { labels, image } = await page.evaluate(async (value) => {
      const { Samples } = await import("/page/samples.js");
      const { Scope } = await import("/page/scope.js");
      const samples = new Samples(), count = 250;
      const buffer = new ArrayBuffer(32 + 4 * 4 * count), view = new DataView(buffer);
      view.setUint8(0, 1); view.setUint8(1, 1); view.setUint16(2, 4, true); view.setUint32(4, 1, true);
      view.setFloat64(8, 0, true); view.setFloat64(16, 2e-4, true); view.setUint32(24, count, true);
      for (let index = 0; index < 4 * count; index++) view.setFloat32(32 + 4 * index, value, true);
      samples.add(buffer);
      const canvas = document.createElement("canvas");
      canvas.style.cssText = "position: absolute; left: 0; top: 0; width: 700px; height: 600px";
      document.body.append(canvas);
      const context = canvas.getContext("2d"), labels = [];
      context.fillText = (text, x, y) => {
        if (context.textAlign === "right") labels.push({ text, left: x - context.measureText(text).width });
        CanvasRenderingContext2D.prototype.fillText.call(context, text, x, y);
      };
      new Scope(canvas, document.createElement("p"), samples).draw();
      const image = canvas.toDataURL("image/png");
      canvas.remove();
      return { labels, image };
    }, value);
    writeFileSync(`${PICTURES}/labels-${value}.png`, Buffer.from(image.split(",")[1], "base64"));
    assert.ok(labels.length >= 6 && labels.some(({ text }) => text.length > 4), JSON.stringify(labels));
    assert.deepEqual(labels.filter(({ left }) => left < 1), [], `of ${value}`);
  }
  await page.context().close();
});

test("the scope at 5 kHz does not grow in memory", async (context) => {
  const page = await openPage(chrome, daemon.url, DESK);
  await stateIs(page, "disarmed");
  await page.selectOption("#span", "1");
  const session = await page.context().newCDPSession(page);
  const heap = async () => {
    await session.send("HeapProfiler.collectGarbage");
    return (await session.send("Runtime.getHeapUsage")).usedSize;
  };
  const heaps = [];
  for (let count = 0; count < 10; count++) {
    await page.waitForTimeout(SCOPE_S * 100);
    heaps.push(await heap());
  }
  const early = median(heaps.slice(0, 5)), growth = median(heaps.slice(5)) - early, seconds = SCOPE_S / 2;
  const paint = await page.evaluate(() => performance.getEntriesByName("first-contentful-paint")[0]?.startTime);
  context.diagnostic(`heap ${(early / 1e6).toFixed(2)} MB, growth ${(growth / 1e6).toFixed(2)} MB in ${seconds} s; first paint after ${paint.toFixed(0)} ms`);
  // A frame has 4 kB; 20 of them a second that are kept would be 80 kB/s. A single figure differs by up to 0.3 MB from the next:
  // compiled code comes and goes.
  assert.ok(growth < 20e3 * seconds, `${growth} bytes in ${seconds} s`);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test("a page that connects later sees what happened before", async () => {
  const page = await openPage(chrome, daemon.url, DESK);
  await stateIs(page, "disarmed");
  const events = page.locator("#events li");
  await events.first().waitFor(PATIENCE);
  assert.ok(await events.count() > 5);
  await page.waitForFunction(() => !document.getElementById("response-panel").hidden, null, PATIENCE);
  await page.context().close();
});

test("says that its data are old, and connects again by itself", async () => {
  const page = await openPage(chrome, daemon.url, DESK);
  await stateIs(page, "disarmed");
  await daemon.end("SIGKILL");
  await page.waitForFunction(() => /these data are \d+ s old; next attempt in \d+ s/.test(document.getElementById("age").textContent), null, PATIENCE);
  await daemon.start();
  await page.waitForFunction(() => document.getElementById("age").textContent === "" && document.getElementById("state").textContent === "disarmed", null, PATIENCE);
  assert.match(await page.textContent("#daemon-text"), /killed|crash|ended/);
  await page.context().close();
});
