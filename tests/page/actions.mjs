// What a test does on a page.

import { PATIENCE_MS } from "./daemon.mjs";

export const PATIENCE = { timeout: PATIENCE_MS };

export const textIs = (page, id, pattern) => page.waitForFunction(([id, pattern]) => new RegExp(pattern).test(document.getElementById(id).textContent), [id, pattern], PATIENCE);

/** What a page says of the bench, to find the cause of a failure. */
function reportOf(page) {
  const texts = () => Object.fromEntries(["state", "age", "lease-text", "progress-text", "held", "resume-error", "alert", "plan-text", "queue"]
    .map((id) => [id, document.getElementById(id).innerText]));
  return page.evaluate(texts);
}

export async function stateIs(page, wanted) {
  try {
    await textIs(page, "state", `^${wanted}$`);
  } catch (cause) {
    throw new Error(`the page does not show the state ${wanted}: ${JSON.stringify(await reportOf(page))}`, { cause });
  }
}

/** Takes the arm lease for a page, if it does not have it. */
export async function takeLease(page) {
  if (/this page/.test(await page.textContent("#lease-text"))) return;
  await page.click("#lease-button");
  await page.fill("#operator", "anna");
  await page.click("#name-dialog button[value=ok]");
  await textIs(page, "lease-text", "anna .this page");
}

/** Closes a loop that holds the position until it is stopped. The bench must not be held. */
export async function startLoop(page) {
  await stateIs(page, "disarmed");
  await takeLease(page);
  await page.selectOption("#reference", "hold");
  await page.fill("#duration", "3000s");
  await page.selectOption("#on-disconnect", "continue"); // a page on a busy machine may lose its lease
  await page.click("#plan");
  await page.waitForSelector("#start:not([disabled])", PATIENCE);
  await page.click("#start");
  await stateIs(page, "running");
}

/** The stops that a page sends from now on: `settle` or `cut`. */
export function stopsOf(page) {
  const stops = [];
  page.on("request", (request) => { if (request.url().endsWith("/api/v1/stop")) stops.push(request.postDataJSON().how); });
  return stops;
}

/** Presses the mouse in the middle of STOP, wherever it is. */
export async function clickStop(page) {
  const box = await page.locator("#stop").boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
}
