// STOP of the live page works whatever has the focus, whatever is open, and over a link that fails. Run by tests/page/run.

import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, describe, test } from "node:test";
import { PATIENCE, clickStop, startLoop, stateIs, stopsOf, takeLease } from "./actions.mjs";
import { Daemon, browser, openPage, until } from "./daemon.mjs";
import { Link } from "./link.mjs";

const DESK = { width: 1400, height: 900 }, TABLET = { width: 900, height: 700 }, PHONE = { width: 390, height: 844 };

const daemon = new Daemon();
let chrome;

const loopState = async () => (await daemon.get("/state")).loop.state;

before(async () => {
  await daemon.start();
  chrome = await browser();
});

// The pages under test only stop the loop.
beforeEach(() => daemon.startLoop());

afterEach(async () => {
  for (const context of chrome.contexts()) await context.close();
  await daemon.cut();
});

after(async () => {
  await chrome?.close();
  await daemon.end();
  daemon.remove();
});

async function observer({ url = daemon.url, hasTouch } = {}) {
  const page = await openPage(chrome, url, DESK, "light", { hasTouch });
  await stateIs(page, "running");
  return page;
}

/** Two presses at once: between two of playwright a busy machine may need more than the 1.5 s. */
function pressTwice(page) {
  const press = (key) => document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
  return page.evaluate(`[" ", "Escape"].forEach(${press})`);
}

describe("the space bar stops while the focus is", () => {
  const focused = {
    "on a number field": ["#level", (field) => field.inputValue()],
    "on a select": ["#trigger", (field) => field.inputValue()],
    "on a checkbox": ["#recordings input", (field) => field.isChecked()],
    "on a button": ["#pause", (button) => button.textContent()],
    "on a link": ["#recordings a", () => ""],
    "on the scope": ["#scope", () => ""],
    "on the list of events": ["#events", () => ""],
    "in a text field": ["#run-note", (field) => field.inputValue()],
  };
  for (const [name, [selector, value]] of Object.entries(focused)) {
    test(name, async () => {
      const page = await observer(), control = page.locator(selector).first();
      await control.waitFor(PATIENCE);
      await control.focus();
      const before = await value(control);
      await page.keyboard.press(" ");
      await stateIs(page, "disarmed");
      assert.equal(await value(control), before, "the key does nothing else");
      assert.deepEqual(page.faults, []);
    });
  }

  test("in the open list of a select", async () => {
    const page = await observer();
    await page.click("#trigger");
    await page.waitForFunction(() => document.activeElement.tagName === "OPTION", null, PATIENCE);
    await page.keyboard.press(" ");
    await stateIs(page, "disarmed");
    assert.equal(await page.inputValue("#trigger"), "none");
  });

  test("on the gain field of the page with the lease", async () => {
    await daemon.cut();
    const page = await openPage(chrome, daemon.url, DESK);
    await takeLease(page);
    await page.click("#resume");
    await startLoop(page);
    await page.focus("#tune-gain");
    await page.keyboard.press(" ");
    await stateIs(page, "disarmed");
    assert.equal(await page.inputValue("#tune-gain"), "1");
  });

  test("in the frame of a report", async () => {
    const page = await observer();
    await page.locator("#recordings").getByRole("button", { name: "show" }).last().click();
    await page.frameLocator("#result iframe").locator("body").click(PATIENCE);
    await page.waitForFunction(() => document.activeElement.tagName !== "IFRAME", null, PATIENCE);
    await page.keyboard.press(" ");
    await stateIs(page, "disarmed");
  });
});

test("a space is typed into a text field while nothing moves, and only there", async () => {
  const page = await observer(), stops = stopsOf(page);
  await clickStop(page);
  await daemon.until((state) => state.run === null);
  await stateIs(page, "disarmed");
  const before = stops.length;
  await page.focus("#run-note");
  await page.keyboard.type("a note");
  assert.equal(await page.inputValue("#run-note"), "a note");
  assert.equal(stops.length, before);
  await page.focus("#level");
  await page.keyboard.press(" ");
  // A number has no space. The browser reports the request a little after the key.
  await until(() => stops.length > before);
});

test("a click on STOP stops while the list of a select is open, and Esc closes the list", async () => {
  const page = await observer();
  await page.click("#trigger");
  await page.waitForFunction(() => document.activeElement.tagName === "OPTION", null, PATIENCE);
  await clickStop(page);
  await stateIs(page, "disarmed");
  await page.click("#span");
  await page.waitForFunction(() => document.activeElement.tagName === "OPTION", null, PATIENCE);
  await page.keyboard.press("Escape");
  await page.waitForFunction(() => document.activeElement.tagName !== "OPTION", null, PATIENCE);
});

test("a key that is held down stops once and cuts nothing", async () => {
  const page = await observer(), stops = stopsOf(page);
  for (let count = 0; count < 10; count++) await page.keyboard.down(" ");
  await page.keyboard.up(" ");
  await page.focus("#stop");
  await stateIs(page, "disarmed");
  assert.ok(stops.length > 0 && stops.every((how) => how === "settle"), stops.join());
});

test("Enter that is held down on STOP stops once and cuts nothing", async () => {
  const page = await observer(), stops = stopsOf(page);
  await page.focus("#stop");
  for (let count = 0; count < 10; count++) await page.keyboard.down("Enter");
  await page.keyboard.up("Enter");
  await stateIs(page, "disarmed");
  assert.ok(stops.length > 0 && stops.every((how) => how === "settle"), stops.join());
});

test("a stop that is pressed twice cuts the current, a click counts once", async () => {
  const page = await observer(), stops = stopsOf(page);
  await clickStop(page);
  await stateIs(page, "disarmed");
  assert.ok(stops.every((how) => how === "settle"), stops.join());
  await page.waitForTimeout(1600); // the next press is a first one
  await pressTwice(page);
  await until(() => stops.includes("cut"));
});

test("a tap on a touch screen counts once", async () => {
  const page = await observer({ hasTouch: true }), stops = stopsOf(page);
  await page.tap("#stop");
  await stateIs(page, "disarmed");
  assert.ok(stops.length > 0 && stops.every((how) => how === "settle"), stops.join());
});

/** How each dialog of the page is opened. */
const DIALOGS = {
  "name-dialog": async (page) => {
    await page.selectOption("#reference", "hold");
    await page.click("#plan");
    await page.waitForSelector("#start:not([disabled])", PATIENCE);
    await page.click("#start");
  },
  "note-dialog": (page) => page.locator("#recordings").getByRole("button", { name: "note" }).first().click(),
  "confirm-dialog": (page) => page.locator("#recordings").getByRole("button", { name: "delete" }).first().click(),
  "token-dialog": async (page) => {
    await page.evaluate(() => sessionStorage.clear());
    await DIALOGS["note-dialog"](page);
    await page.click("#note-dialog button[value=ok]");
  },
};

async function openDialog(page, id) {
  await DIALOGS[id](page);
  await page.waitForSelector(`#${id}[open]`, PATIENCE);
}

for (const id of Object.keys(DIALOGS)) {
  describe(`with ${id} open`, () => {
    test("Esc stops and closes the dialog", async () => {
      const page = await observer();
      await openDialog(page, id);
      await page.keyboard.press("Escape");
      await stateIs(page, "disarmed");
      await page.waitForSelector(`#${id}:not([open])`, { ...PATIENCE, state: "attached" });
    });

    test("the space bar stops", async () => {
      const page = await observer();
      await openDialog(page, id);
      await page.keyboard.press(" ");
      await stateIs(page, "disarmed");
    });

    test("the state and STOP are visible at each width, and a click stops", async () => {
      const page = await observer();
      await openDialog(page, id);
      for (const size of [DESK, TABLET, PHONE]) {
        await page.setViewportSize(size);
        await page.waitForFunction(isBelowBar, id, PATIENCE);
        assert.deepEqual(await page.evaluate(covered), [], `${size.width} px`);
      }
      await clickStop(page);
      await stateIs(page, "disarmed");
    });
  });
}

/** Whether a dialog is within the window, below the bar. Runs in the page. */
function isBelowBar(id) {
  const dialog = document.getElementById(id).getBoundingClientRect(), bar = document.querySelector(".bar").getBoundingClientRect();
  return dialog.left >= 0 && dialog.right <= innerWidth && dialog.top >= bar.bottom && dialog.bottom <= innerHeight;
}

/** The state and STOP, if something covers their middle or their corners. Runs in the page. */
function covered() {
  const isCovered = (id) => {
    const { left, right, top, bottom } = document.getElementById(id).getBoundingClientRect();
    const points = [[left + 3, top + 3], [right - 3, bottom - 3], [(left + right) / 2, (top + bottom) / 2]];
    return points.some(([x, y]) => document.elementFromPoint(x, y)?.id !== id);
  };
  return ["state", "stop"].filter(isCovered);
}

describe("over a link", () => {
  let link, page;

  beforeEach(async () => {
    link = new Link(daemon.port);
    await link.open();
    page = await observer({ url: daemon.url.replace(`:${daemon.port}`, `:${link.port}`) });
  });

  afterEach(() => link.close());

  const isShown = () => page.waitForSelector("#undelivered:not([hidden])", PATIENCE);
  const isGone = () => page.waitForSelector("#undelivered", { ...PATIENCE, state: "hidden" });

  test("that is refused the state is unknown, and STOP is repeated until it is delivered", async () => {
    await link.refuse();
    await stateIs(page, "unknown");
    await clickStop(page);
    await isShown();
    assert.match(await page.textContent("#undelivered"), /not delivered .no connection.: use the switch of the supply/);
    assert.equal(await loopState(), "running");
    await link.open();
    await daemon.until((state) => state.loop.state === "disarmed");
    await isGone();
    await stateIs(page, "disarmed");
  });

  test("that is frozen the state is unknown, and STOP is repeated until it is delivered", async () => {
    link.freeze();
    await page.keyboard.press(" ");
    await isShown();
    await stateIs(page, "unknown");
    assert.match(await page.textContent("#undelivered"), /no answer/);
    assert.equal(await loopState(), "running");
    link.thaw();
    await daemon.until((state) => state.loop.state === "disarmed");
    await isGone();
    await stateIs(page, "disarmed");
  });

  test("that fails and comes back the state is known again", async () => {
    link.freeze();
    await stateIs(page, "unknown");
    link.thaw();
    await stateIs(page, "running");
  });

  test("that never comes back from a freeze another connection is opened", async () => {
    link.freeze();
    await stateIs(page, "unknown");
    // New connections pass, the old ones stay frozen.
    link.thawNewOnly();
    await stateIs(page, "running");
  });

  test("that is slow STOP is acknowledged late", async () => {
    link.delayMs = (request) => (request.startsWith("POST /api/v1/stop") ? 1500 : 0);
    await clickStop(page);
    await isShown();
    await isGone();
    await daemon.until((state) => state.loop.state === "disarmed");
  });

  test("that loses the acknowledgement the state shows that it is stopped", async () => {
    link.delayMs = (request) => (request.startsWith("POST /api/v1/stop") ? Infinity : 0);
    await clickStop(page);
    await isShown();
    await isGone();
    await daemon.until((state) => state.loop.state === "disarmed");
  });

  test("whose connections are all occupied STOP is delivered", async () => {
    link.delayMs = (request) => (request.startsWith("GET /api/v1/recordings") ? Infinity : 0);
    await page.evaluate(() => { for (let count = 0; count < 20; count++) fetch(`/api/v1/recordings?${count}`).catch(() => {}); });
    await clickStop(page);
    await stateIs(page, "disarmed");
  });

  test("that is refused a second press asks for zero current", async () => {
    const stops = stopsOf(page);
    await link.refuse();
    await pressTwice(page);
    await until(() => stops.filter((how) => how === "cut").length > 2);
    assert.equal(stops.slice(stops.indexOf("cut")).includes("settle"), false, stops.join());
  });
});

test("a daemon that is frozen: STOP is repeated until it is delivered", async () => {
  const page = await observer();
  try {
    await daemon.freeze();
    await page.keyboard.press("Escape");
    await page.waitForSelector("#undelivered:not([hidden])", PATIENCE);
    await stateIs(page, "unknown");
  } finally {
    daemon.thaw();
  }
  await page.waitForSelector("#undelivered", { ...PATIENCE, state: "hidden" });
  await stateIs(page, "disarmed");
});
