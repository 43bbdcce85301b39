// A link between the page and the daemon that can fail: a TCP proxy.

import { once } from "node:events";
import { connect, createServer } from "node:net";

const REQUEST = /^(GET|HEAD|POST|PUT|DELETE) /;

export class Link {
  #pairs = new Set();
  #isFrozen = false;
  /** Milliseconds by which an answer is late, by the first line of its request; infinite: it never arrives. */
  delayMs = () => 0;

  constructor(port) { this.target = port; }

  /** Listens, the first time at a free port, later at the same one. */
  async open() {
    this.server = createServer({ allowHalfOpen: false }, (client) => this.#join(client));
    this.server.listen(this.port ?? 0, "127.0.0.1");
    await once(this.server, "listening");
    this.port = this.server.address().port;
  }

  /** Closes all connections and refuses new ones. */
  async refuse() {
    const closed = once(this.server, "close");
    this.server.close();
    this.#drop();
    await closed;
  }

  /** Passes nothing on, but keeps everything open: as a link whose proxy has got SIGSTOP. */
  freeze() { this.#setFrozen(true); }

  thaw() { this.#setFrozen(false); }

  async close() {
    if (this.server.listening) await this.refuse();
  }

  /** Passes on what comes over new connections; the old ones stay frozen. */
  thawNewOnly() { this.#isFrozen = false; }

  #setFrozen(isFrozen) {
    this.#isFrozen = isFrozen;
    for (const socket of this.#sockets()) if (isFrozen) socket.pause(); else socket.resume();
  }

  #sockets() { return [...this.#pairs].flatMap(({ client, daemon }) => [client, daemon]); }

  #drop() {
    for (const socket of this.#sockets()) socket.destroy();
    this.#pairs.clear();
  }

  #join(client) {
    const pair = { client, daemon: connect(this.target, "127.0.0.1"), request: "" };
    this.#pairs.add(pair);
    client.on("data", (bytes) => {
      if (REQUEST.test(bytes.toString("latin1", 0, 8))) pair.request = bytes.toString("latin1").split("\r\n", 1)[0];
      pair.daemon.write(bytes);
    });
    pair.daemon.on("data", (bytes) => this.#answer(pair, bytes));
    for (const [one, other] of [[client, pair.daemon], [pair.daemon, client]]) {
      one.on("error", () => {});
      one.on("close", () => { other.destroy(); this.#pairs.delete(pair); });
    }
    if (this.#isFrozen) this.#setFrozen(true);
  }

  #answer(pair, bytes) {
    const delayMs = this.delayMs(pair.request);
    if (delayMs === 0) pair.client.write(bytes);
    else if (delayMs !== Infinity) setTimeout(() => pair.client.write(bytes), delayMs);
  }
}
