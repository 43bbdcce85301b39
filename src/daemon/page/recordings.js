// The list of recordings, and the result of one of them.

import { ask } from "/page/connection.js";
import { table } from "/page/run_form.js";

const byId = (id) => document.getElementById(id);

export async function showRecordings(actions) {
  const { recordings } = await ask("GET", "/recordings");
  byId("recordings").replaceChildren(...recordings.map((recording) => row(recording, actions)));
}

function row(recording, actions) {
  const made = document.createElement("tr");
  const cell = (text) => { made.insertCell().textContent = text ?? ""; };
  const choice = document.createElement("input");
  choice.type = "checkbox";
  choice.value = recording.file;
  choice.setAttribute("aria-label", `compare ${recording.file}`);
  made.insertCell().append(choice);
  cell(recording.file);
  cell([recording.name, recording.note].filter(Boolean).join(": "));
  cell(recording.operator);
  cell(recording.outcome);
  cell(recording.verdict);
  const box = document.createElement("div");
  box.className = "actions";
  const link = document.createElement("a");
  link.href = `/api/v1/recordings/${encodeURIComponent(recording.file)}`;
  link.download = recording.file;
  link.textContent = "download";
  const button = (text, action) => {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = text;
    made.setAttribute("aria-label", `${text} ${recording.file}`);
    made.onclick = () => action(recording);
    return made;
  };
  box.append(button("show", actions.show), link, button("note", actions.note), button("delete", actions.remove));
  made.insertCell().append(box);
  return made;
}

/** Shows the results of a recording: figures and its report. */
export async function showResult(recording) {
  const box = byId("result");
  const heading = document.createElement("h3");
  heading.textContent = recording.file;
  box.replaceChildren(heading);
  try {
    const results = await ask("GET", `/recordings/${encodeURIComponent(recording.file)}/results`);
    box.append(table(figures(results)));
  } catch (error) {
    const text = document.createElement("p");
    text.textContent = error.message;
    box.append(text);
  }
  const report = recording.files.find((file) => file.endsWith("_report.html"));
  const address = report ? `/api/v1/recordings/${encodeURIComponent(report)}` : reportOf([recording.file]);
  await showFrame(box, address, `Report of ${recording.file}`);
}

/** Shows the selected recordings in one plot. */
export async function compare() {
  const files = [...document.querySelectorAll("#recordings input:checked")].map((choice) => choice.value);
  const box = byId("result"), heading = document.createElement("h3");
  heading.textContent = files.length ? `Comparison: ${files.join(", ")}` : "Select recordings in the list first.";
  box.replaceChildren(heading);
  if (files.length) await showFrame(box, reportOf(files), heading.textContent);
  byId("result-heading").scrollIntoView();
}

function reportOf(files) {
  return `/api/v1/report?files=${files.map(encodeURIComponent).join(",")}`;
}

/** A page of the daemon in a frame, or the reason why there is none. */
async function showFrame(box, address, title) {
  const answer = await fetch(address);
  if (!answer.ok) {
    const text = document.createElement("p"), { error } = await answer.json();
    text.textContent = error.message;
    box.append(text);
    return;
  }
  const frame = document.createElement("iframe");
  // The page draws its plots with a script of its own, which gets no access to this page.
  frame.sandbox = "allow-scripts";
  frame.title = title;
  frame.src = address;
  box.append(frame);
}

const um = (metres) => `${(metres * 1e6).toPrecision(4)} um`;

/** The figures of a run that are shown first. */
function figures(results) {
  const rows = [];
  const add = (title, value) => { if (value !== undefined && value !== null && value !== "") rows.push([title, String(value)]); };
  add("End", results.outcome);
  add("Trip", results.trip?.text);
  add("CNMP zeros", results.cnmp);
  add("Reason", Array.isArray(results.why) ? results.why.join("; ") : results.why);
  for (const mode of results.modes ?? []) add(`Mode at ${mode.frequency_hz?.toFixed(2)} Hz`, `residue sign ${mode.sign ?? "unknown"}`);
  const measured = results.measured;
  if (measured?.settling_time_s != null) add("Settling to 2 %", `${(measured.settling_time_s * 1e3).toFixed(1)} ms`);
  if (measured?.overshoot != null) add("Overshoot", `${(measured.overshoot * 100).toFixed(1)} %`);
  if (measured?.sigma_m != null) add("Standard deviation of the error", um(measured.sigma_m));
  add("Ticks", results.ticks);
  add("Ticks not served", results.overruns);
  add("Lost records", results.lost_records);
  return rows;
}
