// The form of a run: order, plan, start.

import { quantity } from "/page/drawing.js";

/** References with a frequency. */
const WITH_FREQUENCY = ["sine", "square", "triangle", "random"];

const byId = (id) => document.getElementById(id);

/** The order that the form stands for. */
export function formOrder() {
  const command = byId("command").value, reference = byId("reference").value, order = { command };
  const add = (option, id) => { const text = byId(id).value.trim(); if (text) order[option] = text; };
  if (command === "control") {
    order.controller = byId("controller").value;
    order.reference = reference;
    add("certificate", "certificate");
    if (WITH_FREQUENCY.includes(reference)) add("frequency", "frequency");
  }
  if (command === "chirp" || (command === "control" && reference === "chirp")) {
    add("start", "from");
    add("stop", "to");
  }
  if (reference !== "hold" || command !== "control") add("amplitude", "amplitude");
  if (command !== "calibrate") add("duration", "duration");
  return order;
}

/** Shows the fields that belong to the command. */
export function showFields() {
  const command = byId("command").value, reference = byId("reference").value;
  const isControl = command === "control";
  const show = (selector, isShown) => document.querySelectorAll(selector).forEach((field) => { field.hidden = !isShown; });
  show(".only-control", isControl);
  show(".only-frequency", isControl && WITH_FREQUENCY.includes(reference));
  show(".only-chirp", command === "chirp" || (isControl && reference === "chirp"));
  show(".not-calibrate", command !== "calibrate");
  byId("amplitude").placeholder = isControl ? "50um" : "0.5A";
}

/** The prediction of a run as rows of a table. */
export function planRows(plan) {
  const expected = plan.expected ?? plan, limits = plan.limits ?? {};
  const rows = [];
  const add = (title, value, limit, unit) => {
    if (typeof value !== "number") return;
    const share = typeof limit === "number" ? ` (${(100 * value / limit).toFixed(0)} % of ${quantity(limit, unit)})` : "";
    rows.push([title, quantity(value, unit) + share]);
  };
  add("Travel", expected.travel_m, limits.travel_m, "m");
  add("Current", expected.current_a, limits.current_a, "A");
  add("Heating current of the motor", expected.thermal_current_a, limits.thermal_current_a, "A");
  add("Duration", expected.duration_s, undefined, "s");
  for (const [title, value] of plan.rows ?? []) rows.push([title, value]);
  return rows;
}

export function table(rows) {
  const made = document.createElement("table");
  for (const [title, value] of rows) {
    const row = made.insertRow();
    const head = document.createElement("th");
    head.scope = "row";
    head.textContent = title;
    row.append(head);
    row.insertCell().textContent = value;
  }
  return made;
}
