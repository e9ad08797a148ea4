// Charts on canvases, in the colours of the page.

const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Return a canvas's context in CSS pixels; its size follows the page.
function context(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas, ratio = devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, width, height);
  g.font = '12px system-ui, "DejaVu Sans", sans-serif';
  g.lineJoin = "round";
  return { g, width, height };
}

// Return round numbers from low to high.
function ticks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 2.5, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.999);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++)
    found.push(k * step);
  return found;
}

const round = (value) => String(Number(value.toPrecision(6)));

// Return a span of values with a margin, at least `least` wide.
function span(lists, scale, least) {
  let low = Infinity, high = -Infinity;
  for (const list of lists)
    for (const value of list) {
      if (value * scale < low) low = value * scale;
      if (value * scale > high) high = value * scale;
    }
  const pad = Math.max(0.06 * (high - low), 0.5 * (least - (high - low)), 1e-9);
  return [low - pad, high + pad];
}

class Chart {
  // x, y: { label, unit, scale, range?, least? }; lines: [{ x?, y, color, dashed?, name }]
  constructor(canvas, x, y, left = 46) {
    Object.assign(this, { canvas, x, y, left, lines: [], shades: [], legend: "" });
    this.layer = document.createElement("canvas");
  }

  show(lines, shades = []) {
    Object.assign(this, { lines, shades });
    this.x.shown = this.x.range ?? span(lines.map((l) => l.x), this.x.scale, this.x.least ?? 0);
    this.y.shown = this.y.range ?? span(lines.map((l) => l.y), this.y.scale, this.y.least ?? 0);
    this.stale = true;
  }

  place(x, y) {
    const [x0, x1] = this.x.shown, [y0, y1] = this.y.shown, { left, right, top, bottom } = this.box;
    return [
      left + ((x * this.x.scale - x0) / (x1 - x0)) * (right - left),
      bottom - ((y * this.y.scale - y0) / (y1 - y0)) * (bottom - top),
    ];
  }

  // Draw axes, and lines up to the end or up to a row.
  draw(row, tail = 0) {
    const { g, width, height } = context(this.canvas);
    this.box = { left: this.left, right: width - 8, top: 24, bottom: height - (this.x.label ? 36 : 20) };
    if (!this.lines.length) return;
    this.axes(g, width, height);
    const { left, right, top, bottom } = this.box;
    g.save();
    g.beginPath();
    g.rect(left, top, right - left, bottom - top);
    g.clip();
    for (const line of this.lines) {
      if (tail) {
        this.path(g, line, 0, line.y.length, 0.45, 1.2);
        this.path(g, line, Math.max(0, row - tail), row + 1, 1, 2);
      } else this.path(g, line, 0, line.y.length, 1, line.width ?? 1.8);
    }
    g.restore();
    this.cursor(g, row, tail);
  }

  path(g, line, first, end, alpha, width) {
    g.globalAlpha = alpha * (line.alpha ?? 1);
    g.strokeStyle = ink(line.color);
    g.lineWidth = width;
    g.setLineDash(line.dashed ? [5, 4] : []);
    g.beginPath();
    for (let k = first; k < end; k++) {
      const [x, y] = this.place(line.x[k], line.y[k]);
      if (k === first) g.moveTo(x, y);
      else g.lineTo(x, y);
    }
    g.stroke();
    g.setLineDash([]);
    g.globalAlpha = 1;
  }

  axes(g, width, height) {
    const { left, right, top, bottom } = this.box;
    g.fillStyle = ink("--band");
    for (const [from, to] of this.shades) {
      const [a] = this.place(from, 0), [b] = this.place(to, 0);
      g.fillRect(a, top, b - a, bottom - top);
    }
    g.lineWidth = 1;
    g.strokeStyle = ink("--rule");
    g.fillStyle = ink("--soft");
    g.textBaseline = "middle";
    g.textAlign = "right";
    for (const value of ticks(...this.y.shown, Math.max(2, (bottom - top) / 42))) {
      const [, y] = this.place(0, value / this.y.scale);
      g.beginPath();
      g.moveTo(left, Math.round(y) + 0.5);
      g.lineTo(right, Math.round(y) + 0.5);
      g.stroke();
      g.fillText(round(value), left - 7, y);
    }
    g.textAlign = "center";
    g.textBaseline = "top";
    for (const value of ticks(...this.x.shown, Math.max(2, (right - left) / 64))) {
      const [x] = this.place(value / this.x.scale, 0);
      g.beginPath();
      g.moveTo(Math.round(x) + 0.5, bottom);
      g.lineTo(Math.round(x) + 0.5, bottom + 4);
      g.stroke();
      if (this.x.bare) continue;
      g.fillText(round(value), Math.min(x, width - 10), bottom + 6);
    }
    if (this.x.label) g.fillText(`${this.x.label} [${this.x.unit}]`, (left + right) / 2, bottom + 21);
    g.textAlign = "left";
    g.textBaseline = "alphabetic";
    g.fillStyle = ink("--ink");
    const title = `${this.y.label} [${this.y.unit}]`;
    g.fillText(title, 0, 13);
    let x = Math.max(g.measureText(title).width + 18, 0);
    for (const line of this.lines.filter((l) => l.name)) {
      g.strokeStyle = ink(line.color);
      g.lineWidth = 2;
      g.setLineDash(line.dashed ? [5, 4] : []);
      g.beginPath();
      g.moveTo(x, 9);
      g.lineTo(x + 18, 9);
      g.stroke();
      g.setLineDash([]);
      g.fillStyle = ink("--soft");
      g.fillText(line.name, x + 23, 13);
      x += g.measureText(line.name).width + 36;
    }
  }

  cursor(g, row, tail) {
    const { top, bottom } = this.box;
    if (!tail) {
      const [x] = this.place(this.lines[0].x[row], 0);
      g.strokeStyle = ink("--soft");
      g.lineWidth = 1;
      g.beginPath();
      g.moveTo(x, top);
      g.lineTo(x, bottom);
      g.stroke();
    }
    for (const line of this.lines) {
      if (line.dashed) continue;
      const [x, y] = this.place(line.x[row], line.y[row]);
      g.fillStyle = ink(line.color);
      g.beginPath();
      g.arc(x, y, tail ? 5 : 3.5, 0, 7);
      g.fill();
    }
  }
}
