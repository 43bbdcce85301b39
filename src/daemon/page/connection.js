// Requests to the daemon and its live messages. The connection is opened again by itself.

const WAITS_S = [1, 2, 4, 8, 10];

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
export async function ask(method, path, body, lease) {
  const headers = {};
  if (token.get()) headers.Authorization = `Bearer ${token.get()}`;
  if (lease) headers["Bench-Lease"] = lease;
  if (body !== undefined) headers["Content-Type"] = "application/json";
  const answer = await fetch(`/api/v1${path}`, { method, headers, body: body === undefined ? undefined : JSON.stringify(body) });
  const text = await answer.text();
  const json = text ? JSON.parse(text) : null;
  if (!answer.ok) throw new DaemonError(answer.status, json?.error);
  return json;
}

/** Opens the live connection; calls `onsamples`, `onmessage`, `onopen` and `onclose` of the handler. */
export function follow(handler) {
  let failures = 0;
  const open = () => {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/api/v1/live?history=true`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { failures = 0; handler.onopen(); };
    socket.onmessage = (message) => {
      if (message.data instanceof ArrayBuffer) handler.onsamples(message.data);
      else handler.onmessage(JSON.parse(message.data));
    };
    socket.onclose = () => {
      const waitS = WAITS_S[Math.min(failures++, WAITS_S.length - 1)];
      handler.onclose(waitS);
      setTimeout(open, waitS * 1000);
    };
  };
  open();
}
