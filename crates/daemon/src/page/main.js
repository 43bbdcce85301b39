// The live page: connects the panels with the daemon.

import { Live, ask, token } from "/page/connection.js";
import { askDialog, cancelDialog } from "/page/dialogs.js";
import { forgetColours, quantity } from "/page/drawing.js";
import { showHeld } from "/page/held.js";
import { keepKeysOutOfFrames, listenToStopButton, listenToStopKeys } from "/page/keys.js";
import { Lease } from "/page/lease.js";
import { isStopped, mayMove } from "/page/motion.js";
import { compare, showRecordings, showResult } from "/page/recordings.js";
import { Response } from "/page/response.js";
import { formOrder, planRows, showFields, table } from "/page/run_form.js";
import { Samples } from "/page/samples.js";
import { Scope } from "/page/scope.js";
import { Spectrum } from "/page/spectrum.js";
import { Stop } from "/page/stop.js";
import { drawTiming } from "/page/timing.js";

const byId = (id) => document.getElementById(id);
const SHARE_TITLES = { travel: "Travel", current: "Current", motor_heat: "Heat of the motor", probe_age: "Age of the reading" };
const EVENTS = 200;
/** The state is unknown when the last message is older than this. */
const OLD_MS = 1000;
/** Time between two looks at the age of the last message. */
const AGE_MS = 100;
/** Time between two looks at a process that analyses its recording. */
const PROCESS_MS = 500;

const samples = new Samples();
const scope = new Scope(byId("scope"), byId("scope-readout"), samples);
const spectrum = new Spectrum(byId("spectrum"), byId("spectrum-readout"), byId("spectrum-text"), samples);
const response = new Response(byId("response"), byId("response-readout"));
const lease = new Lease();
const stop = new Stop(showUndelivered);
let state = null, receivedMs = -Infinity, waitsUntilMs = 0, planned = "";

/* --- messages of the daemon --- */

function isOld() {
  return performance.now() - receivedMs > OLD_MS;
}

/** Whether something moves or may move, as far as this page knows. */
function mayMoveNow() {
  return stop.isPending || isOld() || mayMove(state);
}

function onMessage(message) {
  receivedMs = performance.now();
  if (message.type === "state") showState(message.state);
  if (message.type === "state" && live.steadySinceMs !== null && isStopped(message.state)) stop.seenStopped(live.steadySinceMs);
  if (message.type === "event") addEvent(message);
  if (message.type === "response") showResponse(message.response);
  if (message.type === "lagged") addEvent({ time_s: samples.endS, kind: "lost", text: `this page was too slow: ${message.frames} frames are not shown; the recording is complete` });
}

function onSamples(buffer) {
  receivedMs = performance.now();
  const before = samples.last(0, 1);
  samples.add(buffer);
  if (before) checkLevelTrigger();
}

let lastLevel = null;
function checkLevelTrigger() {
  const signal = { position: 1, error: 2, current: 3 }[byId("trigger").value];
  if (!signal || scope.isPaused || scope.triggerS !== undefined) { lastLevel = null; return; }
  const level = Number(byId("level").value) * (signal === 3 ? 1 : 1e-6);
  const [found] = samples.columns(signal, samples.endS - 0.05, samples.endS, 1);
  if (!found) return;
  if (lastLevel !== null && lastLevel < level && found[1] >= level) scope.trigger(samples.endS - 0.05);
  lastLevel = found[1];
}

function addEvent(event) {
  scope.events.push(event);
  if (scope.events.length > EVENTS) scope.events.shift();
  const item = document.createElement("li");
  item.textContent = `${event.time_s.toFixed(3)} s  ${event.text}`;
  if (event.kind === "trip") item.className = "message";
  byId("events").prepend(item);
  while (byId("events").children.length > EVENTS) byId("events").lastChild.remove();
  if (byId("trigger").value === "event" && ["state", "trip"].includes(event.kind) && !scope.isPaused) scope.trigger(event.time_s);
}

/* --- panels --- */

function showResponse(next) {
  byId("response-panel").hidden = false;
  setText("response-text", `Chirp of run ${next.run}: estimate so far, with the delay of the loop. The result is computed after the run.`);
  response.show(next);
}

function setText(id, text) {
  const element = byId(id);
  if (element.textContent !== text) element.textContent = text;
}

function showState(next) {
  const wasRunning = state?.run?.id;
  state = next;
  showAge();
  showLease();
  showHeld(next, lease.isHeld);
  showShares(next.shares);
  showAlert();
  showRun();
  showTiming();
  const refused = next.loop.refused.length ? ` Not granted: ${next.loop.refused.join("; ")}.` : "";
  setText("daemon-text", `bench ${next.daemon.version}, configuration ${next.daemon.config}, ${next.daemon.rig}, amplifier ${next.daemon.amplifier ?? "not open"}, probe ${next.daemon.probe ?? "not open"}; ${next.daemon.start_reason}; recordings in ${next.daemon.recordings}.${refused}`);
  if (wasRunning && next.run?.id !== wasRunning) runEnded(wasRunning);
}

function showLease() {
  const held = state?.lease;
  setText("lease-text", held ? `arm lease: ${held.operator}${lease.isHeld ? " (this page)" : ""}` : "arm lease: free");
  byId("lease-button").disabled = Boolean(held) && !lease.isHeld;
  setText("lease-button", lease.isHeld ? "Release" : "Take lease");
}

function showShares(shares) {
  const list = byId("shares");
  if (list.children.length !== shares.length * 3) {
    list.replaceChildren(...shares.flatMap((share) => {
      const title = document.createElement("dt"), track = document.createElement("dd"), figure = document.createElement("dd");
      title.textContent = SHARE_TITLES[share.name] ?? share.name;
      track.className = "track-cell";
      track.innerHTML = '<div class="track"><div class="fill"></div></div>';
      figure.className = "figure";
      return [title, figure, track];
    }));
  }
  shares.forEach((share, index) => {
    const fill = list.children[3 * index + 2].querySelector(".fill");
    fill.style.width = `${Math.min(100, 100 * share.share)}%`;
    fill.className = `fill${share.share >= 1 ? " limit" : share.share >= 0.8 ? " high" : ""}`;
    const figure = list.children[3 * index + 1];
    const text = `${(100 * share.share).toFixed(1)} %, ${quantity(share.value, share.unit)} of ${quantity(share.limit, share.unit)}`;
    if (figure.textContent !== text) figure.textContent = text;
  });
}

function showAlert() {
  const alert = byId("alert"), trip = state.trip, fault = state.daemon.fault, defect = state.loop.recording_defect;
  alert.hidden = !trip && !fault && !defect;
  const key = [trip?.text, fault, defect].filter(Boolean).join("; ");
  if (alert.dataset.key === key) return;
  alert.dataset.key = key;
  alert.replaceChildren();
  if (!key) return;
  const paragraph = (text) => { const made = document.createElement("p"); made.textContent = text; alert.append(made); };
  if (trip) paragraph(`Tripped: ${trip.text}`);
  else if (fault) paragraph(`The rig is not ready: ${fault}`);
  if (defect) paragraph(`Not recorded: ${defect}`);
  if (trip) {
    paragraph(`Remedy: ${trip.remedy}`);
    const button = document.createElement("button");
    button.textContent = "Acknowledge";
    button.onclick = () => withLease(() => lease.ask("POST", "/clear"), showAlertError);
    alert.append(button);
  }
}

function showAlertError(message) {
  const line = document.createElement("p");
  line.className = "message";
  line.textContent = message;
  byId("alert").append(line);
}

function showRun() {
  const run = state.run;
  byId("progress-box").classList.toggle("is-empty", !run);
  if (run) {
    const progress = run.progress, isAnalysing = run.phase === "analysing";
    const left = progress?.remaining_s != null && !isAnalysing ? `, ${progress.remaining_s.toFixed(0)} s left` : "";
    setText("progress-text", `Run ${run.id}, ${run.command}${run.name ? ` "${run.name}"` : ""} of ${run.operator}: ${run.phase}${left}${run.is_orphan ? " (client disconnected)" : ""}`);
    const bar = byId("progress");
    if (isAnalysing || !progress?.total) bar.removeAttribute("value"); else bar.value = progress.done / progress.total;
  }
  byId("tune").disabled = !(lease.isHeld && run?.command === "control" && run.phase === "running");
  showQueue();
}

function showQueue() {
  const list = byId("queue"), key = JSON.stringify(state.queue.map((run) => [run.id, run.phase, run.estimated_s]));
  if (list.dataset.key === key) return;
  list.dataset.key = key;
  list.replaceChildren(...state.queue.map((run) => {
    const item = document.createElement("li");
    const length = run.estimated_s ? `, about ${run.estimated_s.toFixed(0)} s` : "";
    item.textContent = `${run.command}${run.name ? ` "${run.name}"` : ""} of ${run.operator}, ${run.phase.replaceAll("_", " ")}${length} `;
    const button = document.createElement("button");
    button.textContent = "cancel";
    button.setAttribute("aria-label", `cancel run ${run.id}`);
    button.onclick = () => attempt(() => ask("POST", `/runs/${run.id}/stop`, { how: "settle" }));
    item.append(button);
    return item;
  }));
}

function showTiming() {
  const { lateness_us: late, compute_us: compute, overruns, lost_records: lost, live_dropped: dropped, policy, pace } = state.loop;
  const us = (value) => `${value.toFixed(1)} us`;
  const timing = pace === "virtual" ? "virtual pace: no timing" : `late p50 ${us(late.p50)}, p99 ${us(late.p99)}, max ${us(late.max)}; computing p50 ${us(compute.p50)}, max ${us(compute.max)}`;
  setText("timing-text", `${timing}. ${policy}. Ticks not served: ${overruns}, lost records: ${lost}, not shown here: ${dropped}.`);
  drawTiming(byId("timing"), state.loop.lateness_histogram);
}

/** Waits until the process of a stopped command, whose turn has ended, has analysed the recording. */
async function processEnded(run) {
  while (run.has_process) {
    await new Promise((resolve) => setTimeout(resolve, PROCESS_MS));
    run = await ask("GET", `/runs/${run.id}`);
  }
}

async function runEnded(id) {
  await attempt(async () => {
    const run = await ask("GET", `/runs/${id}`);
    const message = run.message ? `: ${run.message}` : "";
    showPlanText([`Run ${id} ${run.outcome}${message}`], run.outcome === "failed");
    await processEnded(run);
    await showRecordings(recordingActions);
    const { recordings } = await ask("GET", "/recordings");
    const made = recordings.find((recording) => recording.file === run.recording);
    if (made) await showResult(made);
  });
}

/* --- what the operator does --- */

/** Does an action and shows its error. Asks for the token if it is missing. */
async function attempt(action, showError = (message) => showPlanText([message], true)) {
  try {
    return await action();
  } catch (error) {
    if (error.status !== 401) showError(error.message);
    else if (await askToken()) return attempt(action, showError);
    return undefined;
  }
}

async function askToken() {
  if (!await askDialog(byId("token-dialog"))) return false;
  token.set(byId("token").value.trim());
  return true;
}

async function takeLease() {
  byId("operator").value = localStorage.getItem("operator") ?? "";
  if (!await askDialog(byId("name-dialog"))) return;
  await attempt(() => lease.take(byId("operator").value));
  await refresh();
}

async function refresh() {
  await attempt(async () => showState(await ask("GET", "/state")));
}

async function withLease(action, showError) {
  if (!lease.isHeld) await takeLease();
  if (lease.isHeld) await attempt(action, showError);
  await refresh();
}

/** Lets a held bench go on. */
async function resume() {
  setText("resume-error", "");
  await attempt(() => lease.ask("POST", "/resume"), (message) => setText("resume-error", message));
  await refresh();
}

function onStopKey(key) {
  stop.press();
  if (key === "Escape") cancelDialog();
}

function showUndelivered(fault) {
  byId("undelivered").hidden = fault === null;
  setText("undelivered-fault", fault ?? "");
}

function showPlanText(lines, isError) {
  byId("plan-text").replaceChildren(...lines.map((line) => {
    if (line instanceof Node) return line;
    const made = document.createElement("p");
    made.textContent = line;
    if (isError) made.className = "error";
    return made;
  }));
}

async function plan() {
  byId("start").disabled = true;
  showPlanText(["computing the plan"], false);
  await attempt(async () => {
    const wanted = formOrder(), found = await ask("POST", "/plan", wanted);
    showPlanText([table(planRows(found))], false);
    planned = JSON.stringify(wanted);
    byId("start").disabled = false;
  });
}

async function start(event) {
  event.preventDefault();
  const wanted = formOrder();
  if (JSON.stringify(wanted) !== planned) return plan();
  const isSimulated = state?.daemon.rig === "simulated";
  // A simulated run is shown in real time.
  const order = isSimulated ? { ...wanted, pace: "realtime" } : wanted;
  return withLease(async () => {
    const run = await lease.ask("POST", "/runs", { ...order, name: byId("run-name").value, note: byId("run-note").value, on_disconnect: byId("on-disconnect").value });
    showPlanText([run.phase === "held" ? "queued; the bench is held, the run starts after Resume" : "queued"], false);
  });
}

async function tune() {
  const number = (id) => Number(byId(id).value);
  setText("tune-text", "");
  try {
    await lease.ask("POST", "/tune", { reference: number("tune-reference"), gain: number("tune-gain") });
    setText("tune-text", "changing along a ramp of 0.5 s");
  } catch (error) {
    setText("tune-text", error.message);
  }
}

const recordingActions = {
  show: (recording) => attempt(() => showResult(recording)),
  note: async (recording) => {
    byId("note-name").value = recording.name;
    byId("note-text").value = recording.note;
    if (!await askDialog(byId("note-dialog"))) return;
    const body = { name: byId("note-name").value, note: byId("note-text").value };
    await attempt(() => ask("PUT", `/recordings/${encodeURIComponent(recording.file)}/note`, body));
    await attempt(() => showRecordings(recordingActions));
  },
  remove: async (recording) => {
    byId("confirm-text").textContent = `${recording.file} and the files computed from it are removed.`;
    if (!await askDialog(byId("confirm-dialog"))) return;
    await attempt(() => ask("DELETE", `/recordings/${encodeURIComponent(recording.file)}`));
    await attempt(() => showRecordings(recordingActions));
  },
};

function onKey(event) {
  const isTyping = /^(INPUT|TEXTAREA|SELECT|OPTION)$/.test(event.target.tagName) || document.querySelector("dialog[open]");
  if (isTyping || event.ctrlKey || event.altKey || event.metaKey) return;
  const actions = { p: () => byId("pause").click(), l: () => byId("lease-button").click(), "?": () => document.querySelector("footer").scrollIntoView() };
  const action = actions[event.key];
  if (!action) return;
  event.preventDefault(); // the key is not typed into the dialog that it opens
  action();
}

/* --- start --- */

/** Shows the state, or that it is unknown, and the age of the last message. */
function showAge() {
  const word = isOld() && state ? "unknown" : stateWord();
  setText("state", word);
  byId("state").dataset.state = word === "no rig" ? "tripped" : word;
  document.body.classList.toggle("is-old", isOld());
  setText("age", ageText());
  keepKeysOutOfFrames(mayMoveNow());
}

function stateWord() {
  if (!state) return "connecting";
  return state.daemon.fault ? "no rig" : state.loop.state;
}

function ageText() {
  if (!isOld()) return state?.run ? `run ${state.run.id}: ${state.run.command}` : "";
  if (!state) return "no connection to the daemon yet";
  const ageS = (performance.now() - receivedMs) / 1000, waitS = Math.ceil((waitsUntilMs - performance.now()) / 1000);
  return `these data are ${ageS.toFixed(0)} s old${waitS > 0 ? `; next attempt in ${waitS} s` : ""}`;
}

/** What is not to be covered by the bar of the state and STOP begins below it. */
function followHeightOfBar() {
  const bar = document.querySelector(".bar");
  const setHeight = () => document.documentElement.style.setProperty("--bar-height", `${bar.offsetHeight}px`);
  new ResizeObserver(setHeight).observe(bar);
}

/** The span of the scope after a zoom: one of the list, or another one. */
function showSpan() {
  const text = `${+scope.spanS.toPrecision(3)} s`, other = byId("span-other");
  const listed = [...byId("span").options].find((option) => option !== other && Number(option.value) === scope.spanS);
  other.hidden = Boolean(listed);
  if (!listed) { other.value = scope.spanS; other.textContent = text; }
  byId("span").value = (listed ?? other).value;
}

/** The theme of the system, or the one that the operator chose. */
function useTheme() {
  const theme = byId("theme").value;
  localStorage.setItem("theme", theme);
  document.documentElement.dataset.theme = theme;
  forgetColours();
  response.draw();
  if (state) showTiming();
}

/** After a new connection everything is sent again; another daemon counts its time anew. */
function forgetOldData() {
  samples.clear();
  scope.events.length = 0;
  byId("events").replaceChildren();
  if (scope.isPaused) scope.pause(false);
}

function connectControls() {
  listenToStopKeys(onStopKey, mayMoveNow);
  listenToStopButton(byId("stop"), () => stop.press());
  byId("resume").onclick = resume;
  byId("lease-button").onclick = () => (lease.isHeld ? attempt(() => lease.release()).then(refresh) : takeLease());
  byId("pause").onclick = () => scope.pause(!scope.isPaused);
  scope.onpause = () => { byId("pause").setAttribute("aria-pressed", scope.isPaused); setText("pause", scope.isPaused ? "Follow" : "Pause"); };
  scope.onzoom = showSpan;
  byId("span").onchange = () => { scope.spanS = Number(byId("span").value); };
  byId("trigger").onchange = () => { setText("level-unit", byId("trigger").value === "current" ? "A" : "um"); };
  byId("cursors").onclick = () => byId("cursors").setAttribute("aria-pressed", scope.toggleCursors());
  byId("plan").onclick = plan;
  byId("run-form").onsubmit = start;
  byId("run-form").oninput = () => { showFields(); byId("start").disabled = JSON.stringify(formOrder()) !== planned; };
  byId("tune-apply").onclick = tune;
  byId("compare").onclick = () => attempt(compare);
  byId("theme").value = localStorage.getItem("theme") ?? "auto";
  byId("theme").onchange = useTheme;
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", useTheme);
  useTheme();
  document.addEventListener("keydown", onKey);
}

function drawAll(lastMs = 0) {
  return (nowMs) => {
    if (!document.hidden) scope.draw();
    if (nowMs - lastMs > 500 && !document.hidden) {
      lastMs = nowMs;
      spectrum.draw();
    }
    requestAnimationFrame(draw);
  };
}
const draw = drawAll();

token.takeFromAddress();
connectControls();
showFields();
followHeightOfBar();
const live = new Live({
  onopen: () => { forgetOldData(); attempt(() => showRecordings(recordingActions)); },
  onclose: (waitS) => { waitsUntilMs = performance.now() + waitS * 1000; },
  onsamples: onSamples,
  onmessage: onMessage,
});
setInterval(showAge, AGE_MS);
requestAnimationFrame(draw);
