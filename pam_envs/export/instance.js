// An instance of a module; `about` has its inputs, outputs and parameters.
class Instance {
  constructor(instance, about) {
    this.wasm = instance.exports;
    this.about = about;
    this.wasm.init();
    const memory = this.wasm.memory.buffer;
    this.inputs = new Float64Array(memory, this.wasm.inputs(), about.inputs.length);
    this.outputs = new Float64Array(memory, this.wasm.outputs(), about.outputs.length);
    this.parameters = new Float64Array(memory, this.wasm.parameters(), about.parameters.length);
    this.memory = new Uint8Array(memory, this.wasm.state(), this.wasm.state_size());
  }

  // Change a parameter by name; the next reset reads it.
  set(name, value) {
    const k = this.about.parameters.findIndex((p) => p.name === name);
    if (k < 0) throw new RangeError(`there is no parameter named ${name}`);
    const { low, high, unit } = this.about.parameters[k];
    if (!(value >= low && value <= high))
      throw new RangeError(`${name} = ${value} must be from ${low} to ${high} ${unit}`);
    this.parameters[k] = value;
  }

  // Start episode 0 of a seed. A plant, which has no seeds, comes to rest under its inputs.
  reset(seed = 0) {
    this.wasm.reset(seed >>> 0, Math.floor(seed / 4294967296));
    return this.outputs;
  }

  nextEpisode() {
    this.wasm.next_episode();
    return this.outputs;
  }

  // Apply inputs for one control period.
  step(values) {
    this.inputs.set(values);
    this.wasm.step();
    return this.outputs;
  }

  // Return the index of an output.
  index(name) {
    const k = this.about.outputs.findIndex((o) => o.name === name);
    if (k < 0) throw new RangeError(`there is no output named ${name}`);
    return k;
  }

  // Return an output of the last step by name.
  get(name) {
    return this.outputs[this.index(name)];
  }

  save() {
    return this.memory.slice();
  }

  restore(saved) {
    this.memory.set(saved);
  }
}
