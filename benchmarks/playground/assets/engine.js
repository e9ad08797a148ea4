// Simulation: environments and controllers in WebAssembly, without access to the page.

// Return the bytes of base64 text that holds gzip.
async function unpack(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

class Engine {
  constructor(data) {
    this.data = data;
    this.loaded = new Map();
  }

  // Return an instance of a module, `scene/hysteresis` or `scene/controller`.
  async instance(key) {
    if (!this.loaded.has(key)) {
      const about = this.data.modules[key];
      const made = WebAssembly.instantiate(await unpack(about.code), {});
      this.loaded.set(key, new Instance((await made).instance, about));
    }
    return this.loaded.get(key);
  }

  // Return values of parameters in SI, by name; `settings` are those of the page.
  parameters(settings, env) {
    const found = {};
    const { sliders, idle } = this.data.scenes[settings.scene];
    for (const slider of sliders) {
      if (idle[settings.hysteresis].includes(slider.name)) continue;
      const known = env.about.parameters.find((p) => p.name === slider.parameter);
      const unit = slider.relative ? known.start : slider.factor;
      found[slider.parameter] = settings.values[slider.name] * unit;
    }
    return found;
  }

  // Run one episode. Returns its length, the outputs of every period, row after row, and the
  // seconds that the environment and the controller took.
  async run(settings, most = Infinity) {
    const env = await this.instance(`${settings.scene}/${settings.hysteresis}`);
    const open = settings.controller === "sweep";
    const acting = open ? null : await this.instance(`${settings.scene}/${settings.controller}`);
    for (const [name, value] of Object.entries(this.parameters(settings, env)))
      env.set(name, value);
    const width = env.outputs.length, ends = [env.index("terminated"), env.index("truncated")];
    const seen = acting ? acting.inputs.length : 0;
    const rows = [];
    env.reset(settings.seed);
    if (acting) acting.reset();
    rows.push(env.outputs.slice());
    const action = new Float64Array(1), began = performance.now();
    while (rows.length <= most && !ends.some((k) => env.outputs[k] > 0)) {
      if (acting) {
        acting.inputs.set(env.outputs.subarray(0, seen));
        acting.wasm.step();
        env.inputs.set(acting.outputs);
      } else {
        action[0] = this.sweep(rows.length - 1);
        env.inputs.set(action);
      }
      env.wasm.step();
      rows.push(env.outputs.slice());
    }
    const seconds = (performance.now() - began) / 1000;
    return new Episode(rows, width, env, this.data.scenes[settings.scene], seconds);
  }

  sweep(step) {
    const phase = (step % this.data.sweep) / (this.data.sweep / 2);
    const up = phase <= 1 ? phase : 2 - phase;
    return Math.fround(1.75 * up - 1);
  }

  // Return steps per second of an environment with a constant action: the best of three runs.
  async rate(scene, hysteresis, steps = 10000) {
    const env = await this.instance(`${scene}/${hysteresis}`);
    env.reset(1);
    env.inputs.fill(0);
    for (let k = 0; k < 10000; k++) env.wasm.step(); // until the browser has optimised the code
    let best = 0;
    for (let turn = 0; turn < 3; turn++) {
      const began = performance.now();
      for (let k = 0; k < steps; k++) env.wasm.step();
      best = Math.max(best, (1000 * steps) / (performance.now() - began));
    }
    return best;
  }
}

class Episode {
  constructor(rows, width, env, scene, seconds) {
    Object.assign(this, { rows, width, scene, seconds });
    this.length = rows.length;
    this.period = env.about.period;
    this.places = new Map(env.about.outputs.map((o, k) => [o.name, k]));
    this.signals = new Map();
  }

  // Return an output over time, by name: "state/pressure" for "info.state/pressure".
  signal(name) {
    if (!this.signals.has(name)) {
      const k = this.places.get(`info.${name}`) ?? this.places.get(name);
      if (k === undefined) throw new RangeError(`there is no output named ${name}`);
      this.signals.set(name, Float64Array.from(this.rows, (row) => row[k]));
    }
    return this.signals.get(name);
  }

  // Return root mean square and largest error of the periods that count.
  score() {
    const [a, b] = this.scene.error.map((name) => this.signal(name));
    const gates = this.scene.gate.map((name) => this.signal(name)), time = this.signal("time");
    let sum = 0, count = 0, most = 0;
    for (let k = 0; k < this.length; k++) {
      if (time[k] < this.scene.settled || gates.some((gate) => !(gate[k] > 0.5))) continue;
      const error = a[k] - b[k];
      sum += error * error;
      most = Math.max(most, Math.abs(error));
      count += 1;
    }
    const ended = this.rows[this.length - 1][this.places.get("terminated")] > 0;
    const scale = this.scene.scale;
    return { rms: scale * Math.sqrt(sum / count), most: scale * most, ended };
  }
}

// --- state of the page as text ------------------------------------------------------------------

function usual(data, scene) {
  const about = data.scenes[scene];
  const values = Object.fromEntries(about.sliders.map((s) => [s.name, s.usual]));
  const hysteresis = Object.keys(about.hysteresis)[0];
  return { scene, hysteresis, controller: Object.keys(about.controllers)[0], seed: 1, values };
}

// Return the settings of a link's fragment; what it does not name, or names wrongly, is as usual.
function parsed(data, fragment) {
  const given = new URLSearchParams(fragment.replace(/^#/, ""));
  const known = given.get("scene") in data.scenes;
  const made = usual(data, known ? given.get("scene") : Object.keys(data.scenes)[0]);
  const about = data.scenes[made.scene];
  for (const name of ["hysteresis", "controller"])
    if (given.get(name) in about[name === "controller" ? "controllers" : name])
      made[name] = given.get(name);
  const seed = Number(given.get("seed") ?? 1);
  if (Number.isSafeInteger(seed) && seed >= 0) made.seed = seed;
  for (const { name, low, high } of about.sliders) {
    const value = Number(given.get(name) ?? NaN);
    if (value >= low && value <= high) made.values[name] = value;
  }
  return made;
}

function fragment(settings) {
  const { scene, hysteresis, controller, seed, values } = settings;
  return `#${new URLSearchParams({ scene, hysteresis, controller, seed, ...values })}`;
}

// Return the Python program that computes the same run.
function python(settings) {
  const { scene, hysteresis, controller, seed, values } = settings;
  const listed = Object.entries(values).map(([name, value]) => `    ${name}=${value},\n`);
  return `from benchmarks.playground.replay import replay

run = replay(
    "${scene}",
    hysteresis="${hysteresis}",
    controller="${controller}",
    seed=${seed},
${listed.join("")})
print(run.rms, run.unit)
`;
}
