// Requests to the daemon and its live messages. The connection is opened again by itself.

const WAITS_S = [1, 2];
/** A connection over which nothing arrives for this long is given up. States arrive every 0.2 s. */
const SILENCE_MS = 5000;
/** After a gap of this length messages may be old when they arrive. */
const GAP_MS = 1000;

/** The token of the daemon, from the address of the page or typed in. It is kept for this tab only. */
export const token = {
  get: () => sessionStorage.getItem("token") ?? "",
  set: (text) => sessionStorage.setItem("token", text),
  takeFromAddress() {
    const found = /[#&]token=([^&]+)/.exec(location.hash);
    if (!found) return;
    token.set(found[1]);
    history.replaceState(null, "", location.pathname);
  },
};

export class DaemonError extends Error {
  constructor(status, error) {
    super(error?.message ?? `the daemon answered with status ${status}`);
    this.status = status;
  }
}

/** A request under /api/v1; returns the JSON of the answer. */
export async function ask(method, path, body, lease, signal) {
  const headers = {};
  if (token.get()) headers.Authorization = `Bearer ${token.get()}`;
  if (lease) headers["Bench-Lease"] = lease;
  if (body !== undefined) headers["Content-Type"] = "application/json";
  const answer = await fetch(`/api/v1${path}`, { method, headers, body: body === undefined ? undefined : JSON.stringify(body), signal });
  const text = await answer.text();
  const json = text ? JSON.parse(text) : null;
  if (!answer.ok) throw new DaemonError(answer.status, json?.error);
  return json;
}

/** The live connection. It opens again by itself when it is closed, and when nothing has arrived for some seconds. */
export class Live {
  #failures = 0;
  #heardMs = 0;
  /** When the connection was opened; null while it is closed, and after a gap. */
  steadySinceMs = null;

  /** The handler has `onsamples`, `onmessage`, `onopen` and `onclose`. */
  constructor(handler) {
    this.handler = handler;
    this.#open();
    setInterval(() => this.#watch(), 1000);
  }

  #open() {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/api/v1/live?history=true`);
    this.socket = socket;
    this.#heardMs = performance.now();
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.steadySinceMs = this.#heardMs = performance.now();
      this.handler.onopen();
    };
    socket.onmessage = (message) => this.#receive(message.data);
    socket.onclose = () => this.#close();
  }

  #receive(data) {
    const nowMs = performance.now();
    if (nowMs - this.#heardMs > GAP_MS) this.steadySinceMs = null;
    this.#heardMs = nowMs;
    this.#failures = 0;
    if (data instanceof ArrayBuffer) this.handler.onsamples(data);
    else this.handler.onmessage(JSON.parse(data));
  }

  /** A link that has failed silently never closes. */
  #watch() {
    if (this.socket && performance.now() - this.#heardMs > SILENCE_MS) this.#close();
  }

  #close() {
    const socket = this.socket;
    this.socket = this.steadySinceMs = null;
    socket.onopen = socket.onmessage = socket.onclose = null;
    socket.close();
    const waitS = WAITS_S[Math.min(this.#failures++, WAITS_S.length - 1)];
    this.handler.onclose(waitS);
    setTimeout(() => this.#open(), waitS * 1000);
  }
}
