// A daemon on the simulated stage for a test, and a browser.

import { spawn } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { chromium } from "playwright-core";
import { changeStates } from "./mock.mjs";

const PROGRAM = resolve(process.env.BENCH_PROGRAM ?? "target/release/bench");
/** A folder with the files of the page, to try changes without building. */
const SOURCE = process.env.BENCH_PAGE_SOURCE;
const BROWSER = process.env.BENCH_BROWSER ?? "/usr/bin/chromium";

/** A step that waits longer than this has failed. It is not a requirement. */
export const PATIENCE_MS = 180_000;

/** Waits until a condition is true. */
export async function until(condition) {
  const endMs = performance.now() + PATIENCE_MS;
  while (!await condition()) {
    if (performance.now() > endMs) throw new Error(`not true after ${PATIENCE_MS} ms: ${condition}`);
    await new Promise((done) => setTimeout(done, 50));
  }
}

/** Name and state of each thread of a process that is neither stopped (T) nor ended (Z, X). */
function runningThreads(pid) {
  const running = [];
  for (const thread of readdirSync(`/proc/${pid}/task`)) {
    let stat;
    try {
      stat = readFileSync(`/proc/${pid}/task/${thread}/stat`, "utf8");
    } catch {
      continue; // it has ended
    }
    // The name, in parentheses, may contain any character.
    const [, name, state] = /\((.*)\) (.)/s.exec(stat);
    if (!"TZX".includes(state)) running.push(`${name} (${state})`);
  }
  return running;
}

export class Daemon {
  constructor() {
    this.folder = mkdtempSync(join(tmpdir(), "bench-page-"));
  }

  /**
   * Starts the daemon; the first time at a free port, later at the same one. A busy machine misses ticks and delays threads for seconds:
   * neither missed ticks, nor the motion that follows them, nor a late renewal end a run.
   */
  async start() {
    const changes = ["interlock.overruns_per_s=1000000", "interlock.model_error_off=a busy machine misses ticks", "loop.arm_lease_s=60"];
    const settings = changes.flatMap((change) => ["--set", change]);
    this.process = spawn(PROGRAM, ["serve", "--listen", `127.0.0.1:${this.port ?? 0}`, "--out", "recordings", ...settings], {
      cwd: this.folder, env: { ...process.env, BENCH_SOCKET: join(this.folder, "bench.sock") }, stdio: ["ignore", "pipe", "inherit"],
    });
    this.ended = new Promise((done) => this.process.once("exit", done));
    const address = await new Promise((found, failed) => {
      let text = "";
      this.process.stdout.on("data", (piece) => {
        text += piece;
        const printed = /http:\/\/\S+/.exec(text);
        if (printed) found(printed[0]);
      });
      this.process.once("exit", () => failed(new Error(`the daemon has ended: ${text}`)));
    });
    // The token is printed on a terminal only.
    this.token = readFileSync(join(this.folder, "bench.token"), "utf8").trim();
    this.url = `${address}#token=${this.token}`;
    this.port = new URL(this.url).port;
  }

  async end(signal = "SIGTERM") {
    this.process.kill(signal);
    await this.ended;
  }

  /** Stops every thread. SIGSTOP returns before they are stopped, and one that still runs may answer a request. */
  async freeze() {
    const { pid } = this.process;
    this.process.kill("SIGSTOP");
    const endMs = performance.now() + PATIENCE_MS;
    let running = runningThreads(pid);
    while (running.length > 0) {
      if (performance.now() > endMs) throw new Error(`threads of process ${pid} still run ${PATIENCE_MS} ms after SIGSTOP: ${running.join(", ")}`);
      await new Promise((done) => setTimeout(done, 1));
      running = runningThreads(pid);
    }
  }

  thaw() { this.process.kill("SIGCONT"); }

  /** A request with the token, and with an arm lease if one is given; its answer, null if it has no body. */
  async ask(method, path, body, lease) {
    const headers = { "Authorization": `Bearer ${this.token}`, "Content-Type": "application/json" };
    if (lease) headers["Bench-Lease"] = lease;
    const answer = await fetch(`http://127.0.0.1:${this.port}/api/v1${path}`, { method, headers, body: body && JSON.stringify(body) });
    const text = await answer.text();
    if (!answer.ok) throw new Error(`${method} ${path}: ${answer.status} ${text}`);
    return text === "" ? null : JSON.parse(text);
  }

  get(path) { return this.ask("GET", path); }

  async cut() { await this.ask("POST", "/stop", { how: "cut" }); }

  /** Waits until a condition of the state is true. */
  until(condition) { return until(async () => condition(await this.get("/state"))); }

  /** Resumes, and closes a loop that holds the position until it is stopped. The loop keeps the lease until its end. */
  async startLoop() {
    // The lease of a page that was closed expires.
    await this.until((state) => state.run === null && state.queue.length === 0 && state.lease === null);
    const { lease } = await this.ask("POST", "/lease", { operator: "test" });
    await this.ask("POST", "/resume", undefined, lease);
    const order = { command: "control", fast: true, reference: "hold", duration: "3000s", pace: "realtime" };
    await this.ask("POST", "/runs", { ...order, on_disconnect: "continue" }, lease);
    await this.until((state) => state.loop.state === "running");
    await this.ask("DELETE", "/lease", undefined, lease);
  }

  remove() {
    rmSync(this.folder, { recursive: true, force: true });
  }
}

export function browser() {
  return chromium.launch({ executablePath: BROWSER, args: ["--no-sandbox", "--enable-precise-memory-info"] });
}

const fileName = (url) => url.pathname === "/" ? "index.html" : url.pathname.slice("/page/".length);
const isFileOfPage = (url) => url.pathname === "/" || url.pathname.startsWith("/page/");

/**
 * A page; its faults are collected: errors on the console, refused requests, and requests to other hosts.
 * `change` may change each live state before the page gets it; with `hasTouch` it has a touch screen.
 */
export async function openPage(chrome, url, size, colorScheme = "light", { change, hasTouch } = {}) {
  const context = await chrome.newContext({ viewport: size, colorScheme, hasTouch });
  context.setDefaultTimeout(PATIENCE_MS);
  if (change) await changeStates(context, change);
  const page = await context.newPage();
  page.faults = [];
  // A refused request is also an error on the console, without its address.
  page.on("console", (message) => { if (message.type() === "error" && !message.text().startsWith("Failed to load resource")) page.faults.push(message.text()); });
  page.on("response", (answer) => { if (answer.status() >= 400) page.faults.push(`${answer.status()} ${new URL(answer.url()).pathname}`); });
  page.on("pageerror", (error) => page.faults.push(error.message));
  page.on("request", (request) => { if (new URL(request.url()).host !== new URL(url).host) page.faults.push(`another host: ${request.url()}`); });
  // A page that is not served by the daemon needs the permission to reach it.
  if (SOURCE) await context.grantPermissions(["local-network-access"]);
  if (SOURCE) await page.route(isFileOfPage, (route) => route.fulfill({ path: join(SOURCE, fileName(new URL(route.request().url()))) }));
  await page.goto(url);
  return page;
}
