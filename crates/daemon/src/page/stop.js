// STOP: a stop is repeated until the daemon acknowledges it.

/** A stop that is not acknowledged within this time is repeated, and the page says so. */
const REPEAT_MS = 500;
/** Attempts that may wait for their answer at the same time: an answer may take 2.5 s. A browser opens six connections to a host. */
const OPEN_ATTEMPTS = 5;
/** Two presses within this time cut the current. */
const TWICE_MS = 1500;
/** A state that arrives later than this after the press was made after the press. */
const LATER_MS = 3000;

const NO_ANSWER = "no answer", NO_CONNECTION = "no connection", OTHER_ANSWER = "the answer is not that of the daemon";

/** The stop of this page. At most one waits for its acknowledgement. */
export class Stop {
  #pending = null;
  #pressedMs = -Infinity;
  #attempts = [];
  #fault = NO_ANSWER;
  #timer;

  /** `onfault` gets the reason why the stop is not delivered, and null as soon as it is. */
  constructor(onfault) { this.onfault = onfault; }

  get isPending() { return this.#pending !== null; }

  /** Stops; the second press within 1.5 s cuts the current. */
  press() {
    const nowMs = performance.now(), isTwice = nowMs - this.#pressedMs < TWICE_MS;
    this.#pressedMs = nowMs;
    if (!this.isPending) {
      this.#begin(isTwice ? "cut" : "settle");
      this.#timer = setInterval(() => this.#repeat(), REPEAT_MS);
    } else if (isTwice && this.#pending.how !== "cut") {
      this.#begin("cut");
    }
  }

  /** A state without motion has arrived, over a connection that was opened at `openedMs` and had no gap since. */
  seenStopped(openedMs) {
    const isLater = openedMs > this.#pressedMs || performance.now() - this.#pressedMs > LATER_MS;
    if (this.isPending && isLater) this.#end();
  }

  #begin(how) {
    this.#pending = { how };
    this.#attempt();
  }

  #repeat() {
    this.onfault(this.#fault);
    this.#attempt();
  }

  async #attempt() {
    const pending = this.#pending, attempt = new AbortController();
    this.#fault = NO_ANSWER;
    this.#attempts.push(attempt);
    if (this.#attempts.length > OPEN_ATTEMPTS) this.#attempts.shift().abort();
    const fault = await faultOf(pending.how, attempt.signal);
    this.#attempts = this.#attempts.filter((open) => open !== attempt);
    // An acknowledged `settle` does not acknowledge the `cut` after it.
    if (attempt.signal.aborted || pending !== this.#pending) return;
    if (fault === null) this.#end(); else this.#fault = fault;
  }

  #end() {
    clearInterval(this.#timer);
    this.#pending = null;
    for (const attempt of this.#attempts.splice(0)) attempt.abort();
    this.onfault(null);
  }
}

/** Sends a stop; returns null if the daemon acknowledges it, else why not. */
async function faultOf(how, signal) {
  try {
    return await acknowledgement(await fetch("/api/v1/stop", request(how, signal)));
  } catch {
    return NO_CONNECTION;
  }
}

function request(how, signal) {
  return {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ how }), signal,
    // Requests without credentials have connections of their own: those of other requests, which may be occupied, are not waited for.
    credentials: "omit", keepalive: true, priority: "high",
  };
}

/** Null for an answer of the daemon. A login page of a network answers with status 200 too. */
async function acknowledgement(answer) {
  if (!answer.ok) return `status ${answer.status}`;
  const isOfDaemon = answer.status === 204 || answer.headers.get("Content-Type")?.startsWith("application/json");
  await answer.text(); // leaves the connection to the next attempt
  return isOfDaemon ? null : OTHER_ANSWER;
}
