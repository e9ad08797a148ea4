// Runs scenes in the page, and writes their outputs into an element that the test reads.
const seen = { faults: [], runs: {} };
addEventListener("error", (event) => seen.faults.push(String(event.message)));
addEventListener("unhandledrejection", (event) => seen.faults.push(String(event.reason)));
addEventListener("securitypolicyviolation", (event) => seen.faults.push(event.violatedDirective));
const wait = (met) => new Promise((done) => {
  const look = () => (met() ? done() : setTimeout(look, 20));
  look();
});
const bits = (rows) => {
  const bytes = new Uint8Array(rows.length * rows[0].length * 8);
  rows.forEach((row, k) => bytes.set(new Uint8Array(row.buffer), k * row.length * 8));
  let text = "";
  for (let k = 0; k < bytes.length; k += 8192) text += String.fromCharCode(...bytes.subarray(k, k + 8192));
  return btoa(text);
};
const at = (id) => document.getElementById(id);
const act = (node, value, kind) => {
  node.value = value;
  node.dispatchEvent(new Event(kind));
};
const settled = () => wait(() => document.body.dataset.compared === fragment(page.settings));

async function drive() {
  for (const [name, settings, steps] of JOBS) {
    const run = await engine.run(settings, steps);
    seen.runs[name] = { outputs: bits(run.rows), rms: run.score().rms, python: python(settings) };
  }
  await settled();
  seen.usual = at("score").innerText;
  act(at("slider-load"), "4.5", "input");
  await settled();
  seen.heavy = { score: at("score").innerText, address: location.hash, python: at("python").textContent };
  seen.loaded = page.episode.signal("state/load")[5];
  act(at("hysteresis"), "none", "change");
  await settled();
  seen.idle = at("slider-friction").disabled;
  document.querySelector('[data-scene="knee"]').click();
  await settled();
  seen.ranks = [...document.querySelectorAll("#ranks tr")].map((row) => row.dataset.controller);
  seen.rms = [...document.querySelectorAll("#ranks .number")].map((cell) => Number(cell.textContent));
  seen.pixels = ["scene", "loop", "tracking", "pressure"].map((id) => {
    const canvas = at(id), data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    return new Set(new Uint32Array(data.buffer)).size;
  });
  seen.parsed = fragment(parsed(DATA, seen.heavy.address));
  seen.wrong = fragment(parsed(DATA, "#scene=nowhere&load=99&seed=-3&controller=zero"));
  seen.loadedFiles = performance.getEntriesByType("resource").map((entry) => entry.name);
  seen.widths = [];
  for (const width of [390, 1280]) {
    const frame = document.createElement("iframe");
    frame.style.cssText = `width:${width}px;height:800px;border:0`;
    frame.srcdoc = PAGE;
    document.body.append(frame);
    await wait(() => frame.contentDocument?.body?.dataset?.shown);
    seen.widths.push([width, frame.contentDocument.documentElement.scrollWidth]);
    frame.remove();
  }
}

drive().catch((error) => seen.faults.push(String(error))).finally(() => {
  const made = document.createElement("pre");
  made.id = "seen";
  made.textContent = JSON.stringify(seen);
  document.body.append(made);
});
