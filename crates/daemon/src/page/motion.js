// Whether something moves, judged by a state of the daemon.

/** States of the loop without current. */
const STILL = ["disarmed", "tripped"];
/** Commands that have one run: after it they only compute. */
const WITH_ONE_RUN = ["chirp", "control"];

const isStill = (state) => STILL.includes(state.loop.state);
const onlyComputes = (run) => run.phase === "analysing" && WITH_ONE_RUN.includes(run.command);

/** Whether something moves, or may begin to move without another request. */
export function mayMove(state) {
  if (!state || !isStill(state)) return true;
  if (state.held) return false;
  return [state.run, ...state.queue].some((run) => run && !onlyComputes(run));
}

/** Whether a state shows that a stop was carried out. A daemon without `held` goes on with what waits. */
export function isStopped(state) {
  const holds = state.held === undefined || state.held !== null;
  return holds && !mayMove(state);
}
