"use strict";
// What opens below a row: trajectories, the plant's loop, and all that runs the row again.

const traces = {};
const loading = {};

// Called by the files in data/traces.
function loadTraces(row, found) {
  traces[row] = found.map((trace) => ({ ...trace, values: unpackAll(trace.signals) }));
}

function loaded(row) {
  return (loading[row] ??= new Promise((done, fail) => {
    const src = `data/traces/${encodeURIComponent(row)}.js`, script = make("script", { src });
    script.addEventListener("load", done);
    script.addEventListener("error", () => fail(new Error(`${src} cannot be read; build the page again.`)));
    document.head.append(script);
  }));
}

function unpack({ low, high, steps }) {
  const unit = (high - low || 1) / 2000;
  let place = 0;
  return steps.map((step) => step === null ? NaN : low + (place += step) * unit);
}

function unpackAll(signals) {
  return Object.fromEntries(Object.entries(signals).map(([name, packed]) => [name, unpack(packed)]));
}

function pictures(track, row, rival, number) {
  const ours = traces[row.row][number];
  const theirs = rival && traces[rival.row].find((t) => t.scenario === ours.scenario && t.seed === ours.seed);
  const scaled = (trace, name, factor) => trace.values[name].map((value) => factor * value);
  const clock = (trace) => trace.values.output.map((_, i) => trace.start + i * trace.step);
  const t = clock(ours), wanted = scaled(ours, "reference", track.factor);
  const output = scaled(ours, "output", track.factor);
  const others = theirs && theirs !== ours ? [theirs] : [];
  const name = row.controller, other = rival?.controller ?? "";
  const follow = [
    ...others.map((trace) => ({ x: clock(trace), y: scaled(trace, "output", track.factor), kind: "theirs", name: other })),
    { x: t, y: wanted, kind: "wanted", name: "reference" },
    { x: t, y: output, kind: "ours", name },
  ];
  const off = (values, reference) => values.map((value, i) => value - reference[i]);
  const errors = [
    ...others.map((trace) => ({
      x: clock(trace), kind: "theirs",
      y: off(scaled(trace, "output", track.factor), scaled(trace, "reference", track.factor)),
    })),
    { x: t, y: off(output, wanted), kind: "ours" },
  ];
  const pressures = ours.pressures.map((signal, k) => ({
    x: t, y: scaled(ours, signal, 1e-5), kind: ["ours", "second"][k % 2],
    name: ours.pressures.length > 1 ? "first second".split(" ")[k] : "",
  }));
  const bar = ours.pressures.length ? 1e-5 : track.factor, up = ours.loop[1] === "output" ? track.factor : 180 / Math.PI;
  const loop = [...others.map((trace) => [trace, "theirs"]), [ours, "ours"]].map(([trace, kind]) => ({
    x: scaled(trace, "loop/across", bar), y: scaled(trace, "loop/up", up), kind,
  }));
  const unit = ours.loop[1] === "output" ? track.unit : "deg";
  const time = make("div", {});
  time.append(
    chart({ width: 640, height: 220, lines: follow, up: `output [${track.unit}]` }),
    make("br"), chart({ width: 640, height: 130, lines: errors, up: `error [${track.unit}]` }),
  );
  if (pressures.length) time.append(make("br"), chart({ width: 640, height: 150, lines: pressures, up: "pressure [bar]", across: "time [s]" }));
  const across = `${ours.loop[0]} [${ours.pressures.length ? "bar" : track.unit}]`;
  const loops = make("div", {}, chart({ width: 420, height: 380, lines: loop, up: `the plant's loop: ${ours.loop[1]} [${unit}]`, across }));
  return make("div", { class: "pictures" }, time, loops);
}

function tracesPart(track, row, rival) {
  const part = make("div", { class: "traces" });
  if (!row.traces) { part.append(make("p", { class: "note" }, "No trajectories in this row.")); return part; }
  const rows = [row.row, ...(rival?.traces ? [rival.row] : [])];
  Promise.all(rows.map(loaded)).then(() => {
    const holder = make("div", {}), choice = make("select", { class: "episode" });
    traces[row.row].forEach((trace, k) => {
      const trained = trace.training_seed === null ? "" : `, training seed ${trace.training_seed}`;
      choice.append(make("option", { value: k }, `${trace.scenario}, seed ${trace.seed}${trained}`));
    });
    const draw = () => holder.replaceChildren(pictures(track, row, rival?.traces ? rival : null, Number(choice.value)));
    choice.addEventListener("change", draw);
    part.replaceChildren(make("label", {}, "Episode (public) ", choice), holder);
    draw();
  }).catch((fault) => part.replaceChildren(make("p", { class: "note" }, fault.message)));
  return part;
}

function facts(entries) {
  const list = make("dl", { class: "facts" });
  for (const [name, value] of entries) {
    if (value !== "" && value !== null && value !== undefined) list.append(make("dt", {}, name), make("dd", {}, String(value)));
  }
  return list;
}

function values(names, numbers) {
  const card = (name, k) => make("div", {}, make("span", { class: "soft" }, name), make("b", {}, number(numbers[k])));
  return make("div", { class: "values" }, ...names.map(card));
}

function costText({ steps, seconds, trials, tuning, hardware }) {
  const parts = [];
  if (tuning) parts.push(`tuning: ${tuning}${trials === null ? "" : `, ${trials} trials`}`);
  if (steps !== null) parts.push(`${millions(steps)} steps a training seed`);
  if (seconds !== null) parts.push(`${number(seconds / 60)} min a training seed`);
  if (hardware) parts.push(hardware);
  return parts.join("; ");
}

function detail(track, row, rival) {
  const part = make("div", { class: "detail" });
  part.append(make("p", {}, `${row.summary}. `, make("span", { class: "soft" }, row.citation)));
  part.append(tracesPart(track, row, rival));
  part.append(make("h3", {}, "Every metric"), values(track.columns, row.metrics));
  if (track.settings.length) part.append(make("h3", {}, `RMS [${track.unit}] by setting`), values(track.settings, row.settings));
  const trained = Object.keys(row.trainings), unit = track.unit;
  if (trained.length) {
    part.append(make("h3", {}, `RMS [${unit}] by training seed, ${row.split} episodes`));
    part.append(values(trained.map((seed) => `seed ${seed}`), Object.values(row.trainings)));
  }
  part.append(make("h3", {}, "Its score and its record"), facts([
    ["claim", row.claim], ["IQM", `${bounded(row.iqm)} ${unit}, ${row.split} episodes`],
    ["public RMS", row.gap && `${bounded(row.public)} ${unit}`], ["audit - public", row.gap && `${bounded(row.gap)} ${unit}`],
    ["smooth references", row.smooth && `${bounded(row.smooth)} ${unit}`], ["audit", row.audit], ["state", row.verified],
    ["task", row.task], ["artefact", row.artefact], ["scenarios", track.digest], ["row", row.checksum],
    ["made with", row.made_with], ["commit", row.commit],
  ]));
  part.append(make("h3", {}, "As stated by its maker, not verified"), facts([
    ["cost", costText(row.cost)], ["one answer", row.step_us[0] === null ? "" : `${number(row.step_us[0])} µs (median), ${number(row.step_us[1])} µs (p99)`],
  ]));
  part.append(make("p", {}, make("a", { class: "raw", href: `rows/${encodeURIComponent(row.row)}.json` }, "All of this row as JSON")));
  part.append(make("h3", {}, "Run it again"), make("pre", { class: "again" }, row.again.join("\n")));
  part.append(make("h3", {}, "Cite it"), make("pre", { class: "bibtex" }, row.bibtex));
  return part;
}
