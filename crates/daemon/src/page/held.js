// The held bench: who or what stopped it, what waits, and the button that lets it go on.

const byId = (id) => document.getElementById(id);
const HOW = { settle: ", the run settled", cut: ", the current was cut" };

/** Shows `held` of a state. A daemon without it holds nothing. */
export function showHeld(state, hasLease) {
  const held = state.held ?? null;
  byId("held").hidden = held === null;
  byId("held-badge").hidden = held === null;
  if (held === null) return;
  setText("held-cause", causeText(held));
  setText("held-waiting", waitingText(state.queue.length));
  setText("resume-why", hasLease ? "" : missingLeaseText(state.lease));
  byId("resume").disabled = !hasLease;
}

function causeText(held) {
  const run = held.run == null ? "" : ` in run ${held.run}`;
  const verb = held.cause === "trip" ? "Tripped" : "Stopped";
  return `${verb} ${timeText(held.since_unix_s)}${run}${held.cause === "trip" ? ":" : " by"} ${held.by}${HOW[held.how] ?? ""}.`;
}

/** Time of the day, with the date if it is not of today. */
function timeText(unixS) {
  const time = new Date(unixS * 1000), clock = time.toTimeString().slice(0, 8);
  const isToday = time.toDateString() === new Date().toDateString();
  return isToday ? `at ${clock}` : `on ${time.toLocaleDateString("sv")} at ${clock}`;
}

function waitingText(count) {
  if (count === 0) return "No command waits.";
  return count === 1 ? "1 command waits and starts after Resume." : `${count} commands wait and start after Resume.`;
}

function missingLeaseText(lease) {
  return lease ? `Resume needs the arm lease, which ${lease.operator} holds.` : "Resume needs the arm lease: take it first.";
}

function setText(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}
