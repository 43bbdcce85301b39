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

  async renew() {
    if (!this.isHeld) return;
    try {
      // A renewal that is not answered does not occupy a connection after the next one.
      await ask("PUT", "/lease", undefined, this.secret, AbortSignal.timeout(RENEWAL_MS));
    } catch (error) {
      if (error.status === 403) this.secret = null; // it has expired
    }
  }
}
