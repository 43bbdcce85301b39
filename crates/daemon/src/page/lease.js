// The arm lease of this page.

import { ask } from "/page/connection.js";

const RENEWAL_MS = 3000;

export class Lease {
  constructor() {
    this.secret = null;
    setInterval(() => this.renew(), RENEWAL_MS);
  }

  get isHeld() { return this.secret !== null; }

  async take(operator) {
    const given = await ask("POST", "/lease", { operator });
    this.secret = given.lease;
    localStorage.setItem("operator", operator);
  }

  async release() {
    const secret = this.secret;
    this.secret = null;
    await ask("DELETE", "/lease", undefined, secret);
  }

  /** A request that needs the lease. A lease that has expired is forgotten. */
  async ask(method, path, body, signal) {
    const secret = this.secret;
    try {
      return await ask(method, path, body, secret, signal);
    } catch (error) {
      if (error.status === 403 && this.secret === secret) this.secret = null;
      throw error;
    }
  }

  async renew() {
    if (!this.isHeld) return;
    // A renewal that is not answered does not occupy a connection after the next one.
    await this.ask("PUT", "/lease", undefined, AbortSignal.timeout(RENEWAL_MS)).catch(() => {});
  }
}
