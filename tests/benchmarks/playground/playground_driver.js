// Operates the page and returns what it shows; evaluated in the page with its JOBS.
const seen = { runs: {} };
const until = (met) => new Promise((done) => {
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
const settled = () => until(() => document.body.dataset.compared === fragment(page.settings));

for (const [name, settings, steps] of JOBS) {
  const run = await engine.run(settings, steps);
  seen.runs[name] = { outputs: bits(run.rows), rms: run.score().rms };
}
await settled();
seen.usual = at("score").innerText;
act(at("slider-load"), "4.5", "input");
await settled();
seen.heavy = { score: at("score").innerText, address: location.hash, python: at("python").textContent };
seen.load = page.episode.signal("state/load")[5];
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
seen.files = performance.getEntriesByType("resource").map((entry) => entry.name);
return seen;
