// Histogram of the lateness of the ticks.

import { begin, colour } from "/page/drawing.js";

export function drawTiming(canvas, bars) {
  const { context, width, height } = begin(canvas);
  const largest = Math.log10(1 + Math.max(1, ...bars.counts));
  const room = (width - 16) / bars.counts.length, base = height - 40;
  context.font = context.font.replace(/[\d.]+px/, (size) => `${0.85 * parseFloat(size)}px`);
  context.textAlign = "center";
  // A narrow plot shows every second edge.
  const everyEdge = context.measureText("more").width + 8 < room;
  bars.counts.forEach((count, index) => {
    const top = base - Math.log10(1 + count) / largest * (base - 24);
    context.fillStyle = colour("position");
    context.fillRect(8 + index * room + 2, top, room - 4, base - top);
    context.fillStyle = colour("text");
    const edge = bars.edges_us[index];
    if (everyEdge || index % 2 === 0) context.fillText(edge === undefined ? "more" : `${edge}`, 8 + (index + 0.5) * room, height - 24);
    if (count > 0 && room > 34) context.fillText(short(count), 8 + (index + 0.5) * room, top - 4);
  });
  context.fillStyle = colour("soft");
  context.fillText("late by up to ... us; logarithmic heights", width / 2, height - 6);
}

function short(count) {
  const steps = [[1e9, "G"], [1e6, "M"], [1e4, "k"]];
  const [factor, letter] = steps.find(([factor]) => count >= factor) ?? [1, ""];
  const unit = factor === 1e4 ? 1e3 : factor;
  return factor === 1 ? `${count}` : `${Math.round(count / unit)}${letter}`;
}
