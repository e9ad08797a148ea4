"use strict";
// Tables, filters, sorting. What is shown stands in the address, so that it can be linked to.

const START = { track: BOARD.tracks[0]?.name ?? "", knows: "", kind: "", state: "", query: "", sort: "", down: "", row: "", env: "" };
const ALL = { knows: "anything", kind: "any", state: "any" };
const state = { ...START };

const byName = Object.fromEntries(BOARD.tracks.map((track) => [track.name, track]));
const at = (id) => document.getElementById(id);

function readAddress() {
  Object.assign(state, START, Object.fromEntries(new URLSearchParams(location.hash.slice(1))));
  if (state.row && !(state.row.split("--")[0] in byName)) state.row = "";
  if (state.row) state.track = state.row.split("--")[0];
  if (!(state.track in byName)) state.track = START.track;
}

function go(changes) {
  Object.assign(state, changes);
  const kept = Object.entries(state).filter(([name, value]) => value && (name !== "track" || value !== START.track));
  history.replaceState(null, "", `#${new URLSearchParams(kept)}`);
  render();
}

// Columns of the track's table: heading, what is shown, what is sorted by.
function columns(track) {
  const some = (name) => track.rows.some((row) => row[name]);
  const rival = track.rows.find((row) => row.controller === track.rival)?.score?.[0];
  const scores = track.rows.map((row) => row.score).filter(Boolean);
  const lows = scores.map(([, low]) => low).filter((value) => value > 0);
  const lowest = Math.min(1e9, ...lows), highest = Math.max(0, ...scores.map(([, , high]) => high));
  const range = [lowest, Math.max(Math.min(highest, 10 * (rival || lowest)), 2 * lowest)];
  const step = (row) => row.step_us?.[0] ?? null;
  return [
    { key: "rank", title: "rank", value: (r) => r.place ?? 999, show: (r) => r.rank, number: true },
    { key: "controller", title: "controller", value: (r) => r.controller, show: (r) => r.controller, kind: "name" },
    { key: "kind", title: "kind", value: (r) => r.kind + String(r.seeds).padStart(4, "0"), show: (r) => (r.seeds ? `${r.kind}, ${r.seeds} seed${r.seeds === 1 ? "" : "s"}` : r.kind), kind: "short" },
    { key: "knows", title: "knows", value: (r) => r.knows, show: (r) => r.knows, kind: "short" },
    { key: "score", title: `${track.split} RMS [${track.unit}] [95 %]`, value: (r) => r.score?.[0] ?? null, show: (r) => bounded(r.score), number: true },
    { key: "picture", title: "", show: (r) => (r.score ? intervalPicture(r.score, range, rival) : "–") },
    ...track.headlines.map((title, k) => ({
      key: `h${k}`, title: `${title} [95 %]`, value: (r) => r.headlines[k]?.[0] ?? null, show: (r) => bounded(r.headlines[k]), number: true,
    })),
    some("chance") && { key: "chance", title: `P(improvement), ${track.split} episodes`, value: (r) => r.chance?.[0] ?? null, show: (r) => chance(r.chance), number: true },
    { key: "iqm", title: `IQM [${track.unit}]`, value: (r) => r.iqm?.[0] ?? null, show: (r) => number(r.iqm?.[0]), number: true },
    some("gap") && { key: "public", title: `public RMS [${track.unit}]`, value: (r) => r.public?.[0] ?? null, show: (r) => number(r.public?.[0]), number: true },
    some("gap") && { key: "gap", title: `audit - public [${track.unit}]`, value: (r) => r.gap?.[0] ?? null, show: (r) => signed(r.gap?.[0]), number: true, flag: (r) => r.worse && "worse" },
    some("smooth") && { key: "smooth", title: `smooth [${track.unit}]`, value: (r) => r.smooth?.[0] ?? null, show: (r) => number(r.smooth?.[0]), number: true },
    { key: "preview", title: "preview [s]", value: (r) => r.preview, show: (r) => (r.preview ? number(r.preview) : "none"), number: true },
    ...track.costs.map((index) => ({
      key: `m${index}`, title: track.columns[index], value: (r) => r.metrics[index], show: (r) => number(r.metrics[index]), number: true,
    })),
    { key: "failures", title: "failures", value: (r) => r.failures[0] / r.failures[1], show: (r) => r.failures.join(" of "), number: true },
    { key: "verified", title: "state", value: (r) => r.verified, show: (r) => r.verified, kind: "short" },
    { key: "step", title: "step [µs] *", value: step, show: (r) => number(step(r)), number: true },
    { key: "trained", title: "trained [steps] *", value: (r) => r.cost.steps, show: (r) => millions(r.cost.steps), number: true },
    { key: "trials", title: "tuning trials *", value: (r) => r.cost.trials, show: (r) => (r.cost.trials === null ? "–" : String(r.cost.trials)), number: true },
  ].filter(Boolean);
}

function kept(row) {
  return (!state.knows || row.knows === state.knows) && (!state.kind || row.kind === state.kind)
    && (!state.state || row.state === state.state) && row.controller.includes(state.query.trim());
}

function sorted(rows, chosen) {
  const column = chosen.find((entry) => entry.key === state.sort);
  if (!column) return rows;
  const absent = (value) => value === null || value === undefined || Number.isNaN(value);
  const sign = state.down ? -1 : 1;
  return [...rows].sort((a, b) => {
    const [x, y] = [column.value(a), column.value(b)];
    if (absent(x) || absent(y)) return absent(x) - absent(y);
    return sign * (x < y ? -1 : x > y ? 1 : 0);
  });
}

function headingCell(column) {
  const attributes = column.number ? { class: "number", scope: "col" } : { scope: "col" };
  if (state.sort === column.key) attributes["aria-sort"] = state.down ? "descending" : "ascending";
  if (!column.title) return make("td");
  const button = make("button", { type: "button", "data-sort": column.key }, column.title);
  button.addEventListener("click", () => {
    const again = state.sort === column.key;
    go(again && state.down ? { sort: "", down: "" } : { sort: column.key, down: again ? "1" : "" });
  });
  return make("th", attributes, button);
}

function rowLine(track, row, chosen) {
  const line = make("tr", { class: state.row === row.row ? "pick open" : "pick", tabindex: "0", "data-row": row.row });
  for (const column of chosen) {
    const kind = [column.number ? "number" : column.kind ?? "", column.flag?.(row) || ""].join(" ").trim();
    line.append(make("td", kind ? { class: kind } : {}, column.show(row)));
  }
  const open = () => go({ row: state.row === row.row ? "" : row.row });
  line.addEventListener("click", open);
  line.addEventListener("keydown", (event) => { if (event.key === "Enter") open(); });
  return line;
}

function renderRows() {
  const track = byName[state.track], chosen = columns(track), table = at("rows");
  const body = make("tbody"), rival = track.rows.find((row) => row.controller === track.rival);
  for (const group of BOARD.groups) {
    const rows = sorted(track.rows.filter((row) => row.group === group.name && kept(row)), chosen);
    if (rows.length && group.title) body.append(make("tr", { class: "apart" }, make("td", { colspan: chosen.length }, group.title)));
    for (const row of rows) {
      body.append(rowLine(track, row, chosen));
      if (row.row === state.row) body.append(make("tr", { class: "inside" }, make("td", { colspan: chosen.length }, detail(track, row, rival))));
    }
  }
  table.replaceChildren(make("thead", {}, make("tr", {}, ...chosen.map(headingCell))), body);
  at("about").textContent = `${track.about} Best classical controller: ${track.rival || "none"}.`;
  at("round").textContent = track.round;
  at("figure").src = track.figure;
  at("figure").alt = `Error against effort, and performance profiles: ${track.title}`;
}

function renderFilters() {
  at("track").replaceChildren(...BOARD.tracks.map((track) => make("option", { value: track.name }, `${track.env}: ${track.title}`)));
  at("track").value = state.track;
  for (const name of ["knows", "kind", "state"]) {
    const found = [...new Set(byName[state.track].rows.map((row) => row[name]))].sort();
    at(name).replaceChildren(make("option", { value: "" }, ALL[name]), ...found.map((value) => make("option", { value }, value)));
    at(name).value = state[name];
  }
  if (at("query").value !== state.query) at("query").value = state.query;
}

function headed(heading, lines) {
  const cells = heading.map((text) => make("th", { scope: "col" }, text));
  return [make("thead", {}, make("tr", {}, ...cells)), make("tbody", {}, ...lines)];
}

function renderWinners() {
  const titles = [...new Set(BOARD.winners.flatMap((entry) => Object.keys(entry.rival_scores)))];
  const scores = titles.map((title) => `${title} [95 %]`);
  const heading = ["environment", "verdict", "best classical controller", ...scores, "best learned controller", ...scores, "lower by [95 %]", "P [95 %]", "largest cost", "episodes", "in full"];
  const scored = (name, found) => [
    make("td", { class: "name" }, name), ...titles.map((title) => make("td", { class: "short" }, found[title] ?? "–")),
  ];
  const lines = BOARD.winners.map((entry) => {
    const line = make("tr", { class: "pick", tabindex: "0", "data-track": entry.track });
    line.append(
      make("td", { class: "name" }, entry.env),
      make("td", { class: entry.better ? "verdict good" : "verdict" }, entry.verdict.split(" (")[0]),
      ...scored(entry.rival, entry.rival_scores), ...scored(entry.learned, entry.learned_scores),
      make("td", { class: "short" }, entry.gain),
      make("td", { class: "short" }, chance(entry.chance)), make("td", {}, entry.cost),
      make("td", {}, entry.split || "–"), make("td", { class: "soft" }, entry.verdict),
    );
    const open = () => { go({ track: entry.track, row: "" }); at("track-title").scrollIntoView(); };
    line.addEventListener("click", open);
    line.addEventListener("keydown", (event) => { if (event.key === "Enter") open(); });
    return line;
  });
  at("winners").replaceChildren(...headed(heading, lines));
}

function renderChanges() {
  const heading = ["environment", "track", "first here", "was", "largest fall", "largest rise", "same order (Kendall's tau)", "episodes"];
  const lines = BOARD.changes.flatMap((change) => change.lines.map((cells) => {
    const line = make("tr", { class: "pick", "data-env": change.env });
    line.append(...cells.map((text, k) => make("td", { class: ["name", "short", "", "short", "", "", "number", "short"][k] }, text)));
    line.addEventListener("click", () => go({ env: change.env }));
    return line;
  }));
  at("changes").replaceChildren(...headed(heading, lines));
  const chosen = BOARD.changes.find((change) => change.env === (state.env || byName[state.track].env)) ?? BOARD.changes[0];
  at("places").replaceChildren(...(chosen ? [make("figcaption", { class: "soft" }, `${chosen.env}: places. Blue: learned. Orange: moved by two places or more.`), make("div", { class: "wide", role: "region", tabindex: "0", "aria-label": "Places in the tracks" }, placesPicture(chosen))] : []));
}

function render() { renderFilters(); renderRows(); renderChanges(); }

for (const name of ["track", "knows", "kind", "state"]) {
  at(name).addEventListener("change", () => go(name === "track" ? { track: at(name).value, row: "", knows: "", kind: "", state: "" } : { [name]: at(name).value }));
}
at("query").addEventListener("input", () => go({ query: at("query").value }));
at("filters").addEventListener("submit", (event) => event.preventDefault());
addEventListener("hashchange", () => { if (BOARD.tracks.length) { readAddress(); render(); } });
if (BOARD.tracks.length) {
  readAddress();
  renderWinners();
  render();
  if (state.row) document.querySelector("tr.open")?.scrollIntoView();
} else {
  document.querySelector("main").replaceChildren(make("p", { id: "empty" }, "There are no rows yet: run python -m benchmarks run, then python -m benchmarks site."));
}
