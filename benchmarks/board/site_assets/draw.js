"use strict";
// Numbers, elements and small pictures. All text goes through textContent, never through markup.

const SVG = "http://www.w3.org/2000/svg";

function make(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

function shape(tag, attributes = {}, text = "") {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.textContent = text;
  return made;
}

function number(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.floor(Math.log10(Math.abs(value)));
  if (size < -3 || size > 5) return value.toExponential(1);
  return value.toFixed(Math.max(0, 2 - size));
}

function millions(count) {
  return count === null ? "–" : `${Number((count / 1e6).toPrecision(3))} M`;
}

function bounded(interval) {
  return interval ? `${number(interval[0])} [${number(interval[1])}, ${number(interval[2])}]` : "–";
}

function signed(value) {
  return (value > 0 ? "+" : "") + number(value);
}

function chance(interval) {
  if (!interval) return "–";
  const [value, low, high] = interval.map((part) => part.toFixed(2));
  return `${value} [${low}, ${high}]`;
}

// An interval on the track's common logarithmic scale, with a line where the rival controller is;
// an arrow for what lies beyond the scale.
function intervalPicture(interval, range, rival) {
  const width = 150, height = 16;
  const svg = shape("svg", { width, height, role: "img" });
  const [low, high] = range.map((value) => Math.log(value));
  const place = (value) => {
    const share = (Math.log(Math.max(value, 1e-12)) - low) / (high - low || 1);
    return 4 + (width - 14) * Math.min(1, Math.max(0, share));
  };
  if (rival > 0) {
    svg.append(shape("line", { class: "theirs", x1: place(rival), x2: place(rival), y1: 0, y2: height }));
  }
  svg.append(shape("line", { class: "ours", x1: place(interval[1]), x2: place(interval[2]), y1: 8, y2: 8 }));
  const mark = interval[0] > range[1]
    ? shape("path", { class: "dot", d: `M${width - 9} 4L${width - 1} 8L${width - 9} 12Z` })
    : shape("circle", { class: "dot", cx: place(interval[0]), cy: 8, r: 3 });
  svg.append(mark, shape("title", {}, bounded(interval)));
  return svg;
}

function span(series) {
  let low = Infinity, high = -Infinity;
  for (const values of series) {
    for (const value of values) {
      if (Number.isFinite(value)) { low = Math.min(low, value); high = Math.max(high, value); }
    }
  }
  if (!(high > low)) { const middle = Number.isFinite(low) ? low : 0; low = middle - 1; high = middle + 1; }
  const rest = 0.05 * (high - low);
  return [low - rest, high + rest];
}

function ticks([low, high], wanted) {
  const raw = (high - low) / wanted, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= raw);
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) found.push(k * step);
  return found.map((value) => [value, Number(value.toPrecision(6)).toString()]);
}

function path(xs, ys, toX, toY) {
  let text = "", pen = "M";
  for (let i = 0; i < xs.length; i++) {
    if (!Number.isFinite(xs[i]) || !Number.isFinite(ys[i])) { pen = "M"; continue; }
    text += `${pen}${toX(xs[i]).toFixed(1)} ${toY(ys[i]).toFixed(1)}`;
    pen = "L";
  }
  return text;
}

// Lines over common axes. Each line: {x, y, kind, name}; kind is a class of the style sheet.
function chart({ width, height, lines, across, up }) {
  const left = 58, right = 8, top = 18, bottom = across ? 34 : 18;
  const svg = shape("svg", { width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": up });
  const rangeX = span(lines.map((line) => line.x)), rangeY = span(lines.map((line) => line.y));
  const toX = (v) => left + ((v - rangeX[0]) / (rangeX[1] - rangeX[0])) * (width - left - right);
  const toY = (v) => height - bottom - ((v - rangeY[0]) / (rangeY[1] - rangeY[0])) * (height - top - bottom);
  for (const [value, text] of ticks(rangeX, 6)) {
    svg.append(shape("line", { class: "axis", x1: toX(value), x2: toX(value), y1: top, y2: height - bottom }));
    svg.append(shape("text", { class: "soft", x: toX(value), y: height - bottom + 13, "text-anchor": "middle" }, text));
  }
  for (const [value, text] of ticks(rangeY, Math.max(2, height / 60))) {
    svg.append(shape("line", { class: "axis", x1: left, x2: width - right, y1: toY(value), y2: toY(value) }));
    svg.append(shape("text", { class: "soft", x: left - 5, y: toY(value) + 4, "text-anchor": "end" }, text));
  }
  for (const { x, y, kind } of lines) svg.append(shape("path", { class: kind, d: path(x, y, toX, toY) }));
  svg.append(shape("text", { x: left, y: 11 }, up));
  let place = width - right;
  for (const { name, kind } of [...lines].reverse().filter((line) => line.name)) {
    svg.append(shape("text", { class: "soft", x: place, y: 11, "text-anchor": "end" }, name));
    place -= 6.2 * name.length + 8;
    svg.append(shape("line", { class: kind, x1: place - 14, x2: place, y1: 7, y2: 7 }));
    place -= 24;
  }
  if (across) svg.append(shape("text", { x: width - right, y: height - 4, "text-anchor": "end" }, across));
  return svg;
}

// Places of controllers in one track after the other, a line each.
function placesPicture(change) {
  const names = Object.keys(change.places), count = names.length;
  const step = 190, side = 210, line = 22, top = 34;
  const width = 2 * side + step * (change.tracks.length - 1), height = top + line * count + 26;
  const svg = shape("svg", { width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": "Places of the controllers in each track" });
  const taken = change.tracks.map(() => ({}));
  const spot = (name, k) => {
    const first = change.places[name][k][0];
    const offset = (taken[k][first] = (taken[k][first] ?? -1) + 1);
    return top + line * (first - 1 + offset) + 10;
  };
  const spots = Object.fromEntries(names.map((name) => [name, []]));
  change.tracks.forEach((track, k) => {
    const x = side + step * k;
    svg.append(shape("text", { x, y: 14, "text-anchor": "middle" }, track));
    const tau = k ? `same order: ${change.agreement[k].toFixed(2)}` : "";
    svg.append(shape("text", { class: "soft", x, y: 28, "text-anchor": "middle" }, tau));
    const order = [...names].sort((a, b) => change.order[k].indexOf(a) - change.order[k].indexOf(b));
    for (const name of order) spots[name].push([x, spot(name, k)]);
  });
  for (const name of names) {
    const moves = change.places[name].map(([first]) => first - change.places[name][0][0]);
    const far = Math.max(...moves.map(Math.abs)) >= 2;
    const kind = change.learned.includes(name) ? "place learned" : far ? "place moved" : "place";
    const text = spots[name].map(([x, y], k) => `${k ? "L" : "M"}${x} ${y}`).join("");
    svg.append(shape("path", { class: kind, d: text }));
    spots[name].forEach(([x, y], k) => {
      const [first, shared] = change.places[name][k];
      svg.append(shape("circle", { class: "dot", cx: x, cy: y, r: 3 }));
      if (k === 0) svg.append(shape("text", { x: x - 10, y: y + 4, "text-anchor": "end" }, `${name}  ${first}${shared ? "=" : ""}`));
      else if (k === spots[name].length - 1) svg.append(shape("text", { x: x + 10, y: y + 4 }, `${first}${shared ? "=" : ""}  ${name}`));
      else svg.append(shape("text", { class: "soft", x: x + 6, y: y - 4 }, `${first}${shared ? "=" : ""}`));
    });
  }
  return svg;
}
