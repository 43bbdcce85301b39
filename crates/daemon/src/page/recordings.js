// The list of recordings, and the result of one of them.

import { ask } from "/page/connection.js";
import { table } from "/page/run_form.js";

const byId = (id) => document.getElementById(id);

/** The rows that are shown: the text of the recording, and its row. */
let shownRows = new Map();

/** Shows the list. The row of an unchanged recording stays the same element: a press of one of its buttons and its selection are not lost. */
export async function showRecordings(actions) {
  const { recordings } = await ask("GET", "/recordings");
  const rows = new Map(), selected = new Set(selectedFiles());
  for (const recording of recordings) {
    const text = JSON.stringify(recording);
    rows.set(text, shownRows.get(text) ?? row(recording, actions, selected.has(recording.file)));
  }
  for (const [text, row] of shownRows) if (!rows.has(text)) row.remove();
  [...rows.values()].forEach(placeRow);
  shownRows = rows;
}

/** Puts a row at its place. A row that is there is not touched. */
function placeRow(row, index) {
  const list = byId("recordings"), there = list.rows[index];
  if (there !== row) list.insertBefore(row, there ?? null);
}

function row(recording, actions, isSelected) {
  const made = document.createElement("tr");
  const cell = (text) => { made.insertCell().textContent = text ?? ""; };
  const choice = document.createElement("input");
  choice.type = "checkbox";
  choice.value = recording.file;
  choice.checked = isSelected;
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
export function showResult(recording) {
  return showContent(recording.file, async () => [await figuresOf(recording), await reportFrame(recording)]);
}

/** Shows the selected recordings in one plot. */
export async function compare() {
  const files = selectedFiles();
  if (!files.length) return showContent("Select recordings in the list first.", async () => []);
  const title = `Comparison: ${files.join(", ")}`;
  await showContent(title, async () => [await frame(reportOf(files), title)]);
}

function selectedFiles() {
  return [...document.querySelectorAll("#recordings input:checked")].map((choice) => choice.value);
}

let newestContent = 0;

/** Shows a title, and the content when it is complete. A result that arrives after a later one was asked for is dropped. */
async function showContent(title, content) {
  const number = ++newestContent;
  const heading = document.createElement("h3");
  heading.textContent = title;
  placeContent(heading, paragraph("Loading."));
  const parts = await content();
  if (number === newestContent) placeContent(heading, ...parts);
}

function placeContent(...parts) {
  byId("result").replaceChildren(...parts);
  byId("result-heading").scrollIntoView();
}

async function figuresOf(recording) {
  try {
    return table(figures(await ask("GET", `/recordings/${encodeURIComponent(recording.file)}/results`)));
  } catch (error) {
    return paragraph(error.message);
  }
}

function reportFrame(recording) {
  const report = recording.files.find((file) => file.endsWith("_report.html"));
  const address = report ? `/api/v1/recordings/${encodeURIComponent(report)}` : reportOf([recording.file]);
  return frame(address, `Report of ${recording.file}`);
}

function reportOf(files) {
  return `/api/v1/report?files=${files.map(encodeURIComponent).join(",")}`;
}

/** A page of the daemon in a frame, or the reason why there is none. */
async function frame(address, title) {
  const answer = await fetch(address);
  if (!answer.ok) return paragraph((await answer.json()).error.message);
  const made = document.createElement("iframe");
  // The page draws its plots with a script of its own, which gets no access to this page.
  made.sandbox = "allow-scripts";
  made.title = title;
  made.src = address;
  return made;
}

function paragraph(text) {
  const made = document.createElement("p");
  made.textContent = text;
  return made;
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
