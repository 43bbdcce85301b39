// States of the daemon with additions, for tests of what the page shows.

/** Lets every live state of a page pass through `change` first. Call it before the page is opened. */
export function changeStates(context, change) {
  return context.routeWebSocket(/\/api\/v1\/live/, (page) => {
    const daemon = page.connectToServer();
    daemon.onMessage((message) => page.send(typeof message === "string" ? changed(message, change) : message));
  });
}

function changed(text, change) {
  const message = JSON.parse(text);
  if (message.type === "state") change(message.state);
  return JSON.stringify(message);
}

/** A command that waits. */
export function waiting(id, phase) {
  return { id, command: "chirp", args: [], name: "", note: "", operator: "bob", on_disconnect: "continue", phase, queued_unix_s: 0, estimated_s: 120, is_orphan: false };
}

export const TRIP = { reason: "travel", text: "travel of 1.02 mm exceeds the limit of 1.00 mm", remedy: "move the stage to its middle and reduce the amplitude", time_s: 12.5, run: 7 };
