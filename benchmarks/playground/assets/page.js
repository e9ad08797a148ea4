// The page: settings, playback, charts, comparison.

const one = (id) => document.getElementById(id);
const DATA = JSON.parse(one("data").textContent);
const engine = new Engine(DATA);
const page = { settings: parsed(DATA, location.hash), episode: null, row: 0, playing: true, turn: 0 };
const about = () => DATA.scenes[page.settings.scene];
const BAR = { label: "Pressure", unit: "bar", scale: 1e-5 };
const TIME = { label: "Time", unit: "s", scale: 1 };
const LOOPS = {
  muscle: { y: ["state/contraction", { label: "Contraction", unit: "mm", scale: 1e3, least: 2 }] },
  knee: { y: ["state/stiffness", { label: "Stiffness of the muscle", unit: "N/cm", scale: 1e-2, least: 5 }] },
};
const TRACKED = {
  muscle: { label: "Contraction", unit: "mm", scale: 1e3, least: 2 },
  knee: { label: "Tension", unit: "N", scale: 1, least: 20 },
};
const DRAWINGS = { muscle: drawMuscle, knee: drawLeg };

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

const digits = (value) => (Number.isFinite(value) ? value.toPrecision(3) : "–");

// Show why the page does not show a run.
function fail(error) {
  one("fault").textContent = `This run failed: ${error?.message ?? error}. Reset the settings or load the page again; ` +
    "it needs a browser from May 2023 or later.";
  one("fault").hidden = false;
}
addEventListener("error", (event) => fail(event.error ?? event.message));
addEventListener("unhandledrejection", (event) => fail(event.reason));

// --- settings -----------------------------------------------------------------------------------

function showScenes() {
  const tabs = Object.values(DATA.scenes).map((scene) => {
    const chosen = String(scene.name === page.settings.scene);
    const tab = element("button", { type: "button", role: "tab", "aria-selected": chosen, "data-scene": scene.name }, scene.title);
    tab.addEventListener("click", () => change(usual(DATA, scene.name), true));
    return tab;
  });
  one("scenes").replaceChildren(...tabs);
}

function options(id, titles, chosen) {
  const made = Object.entries(titles).map(([value, title]) => element("option", { value }, title));
  one(id).replaceChildren(...made);
  one(id).value = chosen;
}

const spelled = (slider, value) => value.toFixed(slider.step < 0.1 ? 2 : slider.step < 1 ? 1 : 0);

function showSettings() {
  const { hysteresis, controller, seed, values } = page.settings;
  showScenes();
  options("hysteresis", about().hysteresis, hysteresis);
  options("controller", about().controllers, controller);
  one("seed").value = seed;
  const rows = about().sliders.map((slider) => {
    const { name, label, unit, low, high, step } = slider, id = `slider-${name}`;
    const idle = about().idle[hysteresis].includes(name);
    const shown = element("output", { for: id });
    const input = element("input", { id, type: "range", min: low, max: high, step });
    const write = (value) =>
      shown.replaceChildren(idle ? "no effect" : spelled(slider, value), " ", element("span", {}, idle ? "" : unit));
    input.value = values[name];
    input.disabled = idle;
    write(values[name]);
    input.addEventListener("input", () => {
      const value = Number(input.value);
      write(value);
      change({ ...page.settings, values: { ...page.settings.values, [name]: value } });
    });
    return element("div", { class: idle ? "slider idle" : "slider" }, element("label", { for: id }, label), shown, input);
  });
  one("sliders").replaceChildren(...rows);
}

// Take new settings; `all` also redraws their controls.
function change(settings, all = false) {
  if (settings.scene !== page.settings.scene) page.row = 0;
  page.settings = settings;
  if (all) showSettings();
  one("python").textContent = python(settings);
  page.turn += 1;
  if (!page.busy) compute();
}

// --- results ------------------------------------------------------------------------------------

async function compute() {
  page.busy = true;
  let turn = -1;
  try {
    while (turn !== page.turn) {
      turn = page.turn;
      const episode = await engine.run(page.settings);
      await new Promise(requestAnimationFrame);
      if (turn === page.turn) show(episode);
    }
  } finally {
    page.busy = false;
  }
  await compare(turn);
}

// Put the settings into the address. Browsers refuse this in some frames, and if it is too frequent.
function writeAddress(settings) {
  try {
    history.replaceState(null, "", fragment(settings));
  } catch (error) {
    if (error.name !== "SecurityError") throw error;
  }
}

function show(episode) {
  page.episode = episode;
  const { scene } = page.settings, time = episode.signal("time"), full = about().full;
  const setpoint = episode.signal("observation.set_point").map((v) => 0.5 * (v + 1) * full);
  const shades = about().gate.length ? ungated(episode) : [];
  const [output, reference] = about().error.map((name) => episode.signal(name));
  const loop = LOOPS[scene].y;
  charts.tracking.x.range = charts.pressure.x.range = [0, time[episode.length - 1]];
  charts.tracking.y = { ...TRACKED[scene] };
  charts.loop.y = { ...loop[1] };
  charts.tracking.show([
    { x: time, y: reference, color: "--wanted", dashed: true, name: "reference" },
    { x: time, y: output, color: "--ours", name: "output" },
  ], shades);
  charts.pressure.show([
    { x: time, y: setpoint, color: "--wanted", dashed: true, name: "setpoint", width: 1.2 },
    { x: time, y: episode.signal("state/pressure"), color: "--ours", name: "pressure" },
  ], shades);
  charts.loop.show([{ x: episode.signal("state/pressure"), y: episode.signal(loop[0]), color: "--ours" }]);
  one("row").max = episode.length - 1;
  page.row = Math.min(page.row, episode.length - 1);
  const { rms, most, ended } = episode.score();
  const travel = mean(episode.signal("effort/pressure_travel")) / (episode.period * 1e5);
  const tiles = [
    ["RMS error", digits(rms), about().unit],
    ["Largest error", digits(most), about().unit],
    ["Pressure travel", digits(travel), "bar/s"],
  ];
  const made = tiles.map(([word, value, unit]) =>
    element("div", {}, element("dt", {}, word), element("dd", {}, value, " ", element("span", {}, unit))));
  if (ended)
    made.push(element("div", { class: "warning" }, element("dt", {}, "Ended by a limit"),
      element("dd", {}, ((episode.length - 1) * episode.period).toFixed(1), " ", element("span", {}, "s"))));
  one("score").replaceChildren(...made);
  one("scene").setAttribute("aria-label", about().title);
  one("fault").hidden = true;
  draw();
}

const mean = (values) => values.reduce((a, b) => a + b, 0) / values.length;

// Return spans of time in which errors do not count.
function ungated(episode) {
  const time = episode.signal("time"), gates = about().gate.map((name) => episode.signal(name));
  const spans = [];
  let open = null;
  for (let k = 0; k < episode.length; k++) {
    const out = gates.some((gate) => !(gate[k] > 0.5));
    if (out && open === null) open = time[k];
    if ((!out || k === episode.length - 1) && open !== null) {
      spans.push([open, time[k]]);
      open = null;
    }
  }
  return spans;
}

async function compare(turn) {
  const scored = [];
  one("measure").textContent = `RMS [${about().unit}]`;
  for (const name of Object.keys(about().controllers)) {
    if (name === "sweep") continue;
    await new Promise((done) => setTimeout(done, 15));
    if (turn !== page.turn) return;
    const run = await engine.run({ ...page.settings, controller: name });
    scored.push([name, run.score()]);
  }
  if (turn !== page.turn) return;
  const rank = (score) => (Number.isFinite(score.rms) ? score.rms : Infinity);
  scored.sort((a, b) => rank(a[1]) - rank(b[1]) || 0);
  const most = Math.max(...scored.map(([, score]) => score.rms || 0));
  one("ranks").replaceChildren(...scored.map(([name, { rms, ended }]) => {
    const button = element("button", { type: "button" }, about().controllers[name]);
    button.addEventListener("click", () => change({ ...page.settings, controller: name }, true));
    const bar = element("div");
    bar.style.width = `${(100 * (rms || 0)) / most}%`;
    return element("tr", { class: name === page.settings.controller ? "chosen" : "", "data-controller": name },
      element("td", {}, button), element("td", { class: "number" }, digits(rms) + (ended ? " *" : "")),
      element("td", { class: "wide" }, bar));
  }));
  const gate = about().gate.length ? ", in stance only (not shaded)" : "";
  one("note").textContent = `Errors in this episode from ${about().settled} s on${gate}.` +
    (scored.some(([, score]) => score.ended) ? " * Ended early by a limit." : "");
  writeAddress(page.settings);
  document.body.dataset.compared = fragment(page.settings);
}

// --- playback -----------------------------------------------------------------------------------

const charts = {
  tracking: new Chart(one("tracking"), { ...TIME, label: "", bare: true }, {}),
  pressure: new Chart(one("pressure"), { ...TIME }, { ...BAR, least: 0.5 }),
  loop: new Chart(one("loop"), { ...BAR, least: 0.5 }, {}),
};

function draw() {
  if (!page.episode) return;
  const row = Math.floor(page.row), tail = Math.round(4 / page.episode.period);
  DRAWINGS[page.settings.scene](one("scene"), page.episode, row);
  charts.loop.draw(row, tail);
  charts.tracking.draw(row);
  charts.pressure.draw(row);
  one("row").value = row;
}

function play(on) {
  page.playing = on;
  one("play").textContent = on ? "Pause" : "Play";
}

let last = 0;
function frame(now) {
  const passed = Math.min(0.1, (now - last) / 1000);
  last = now;
  if (page.playing && page.episode && page.episode.scene === about() && !document.hidden) {
    page.row += passed / page.episode.period;
    if (page.row >= page.episode.length) page.row = 0;
    draw();
  }
  requestAnimationFrame(frame);
}

async function copy(id, words) {
  const button = one(id), before = button.textContent;
  try {
    await navigator.clipboard.writeText(words);
    button.textContent = "Copied";
  } catch {
    button.textContent = "Not allowed here";
  }
  setTimeout(() => (button.textContent = before), 1200);
}

for (const id of ["hysteresis", "controller"])
  one(id).addEventListener("change", () => change({ ...page.settings, [id]: one(id).value }, true));
one("seed").addEventListener("change", () => {
  const seed = Math.max(0, Math.min(Number.MAX_SAFE_INTEGER, Math.round(Number(one("seed").value) || 0)));
  change({ ...page.settings, seed }, true);
});
one("next").addEventListener("click", () => change({ ...page.settings, seed: page.settings.seed + 1 }, true));
one("usual").addEventListener("click", () => change(usual(DATA, page.settings.scene), true));
one("play").addEventListener("click", () => play(!page.playing));
one("row").addEventListener("input", () => {
  play(false);
  page.row = Number(one("row").value);
  draw();
});
one("copy").addEventListener("click", () => copy("copy", python(page.settings)));
one("link").addEventListener("click", () => copy("link", location.href.split("#")[0] + fragment(page.settings)));
addEventListener("hashchange", () => change(parsed(DATA, location.hash), true));
addEventListener("resize", draw);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);

play(!matchMedia("(prefers-reduced-motion: reduce)").matches);
change(page.settings, true);
requestAnimationFrame(frame);
setTimeout(async () => {
  const { scene, hysteresis } = page.settings, rate = await engine.rate(scene, hysteresis);
  one("rate").textContent = `${(rate / 1e6).toFixed(2)} million steps per second in this browser`;
}, 3000);
