// Drawings of the scenes: a muscle that lifts a load, and a leg with the orthosis.

const mixed = (a, b, share) => `color-mix(in srgb, ${ink(a)}, ${ink(b)} ${Math.round(100 * share)}%)`;

function stroke(g, points, color, width, dash = []) {
  g.strokeStyle = color;
  g.lineWidth = width;
  g.setLineDash(dash);
  g.beginPath();
  points.forEach(([x, y], k) => (k ? g.lineTo(x, y) : g.moveTo(x, y)));
  g.stroke();
  g.setLineDash([]);
}

function fill(g, points, color) {
  g.fillStyle = color;
  g.beginPath();
  points.forEach(([x, y], k) => (k ? g.lineTo(x, y) : g.moveTo(x, y)));
  g.closePath();
  g.fill();
}

function text(g, words, x, y, color = "--soft", align = "left") {
  g.fillStyle = ink(color);
  g.textAlign = align;
  g.textBaseline = "middle";
  g.fillText(words, x, y);
}

// A bar of the pressure at the right edge.
function gauge(g, width, height, pressure, full) {
  const top = 40, bottom = height - 26, x = width - 26, share = Math.min(1, pressure / full);
  g.fillStyle = ink("--band");
  g.fillRect(x, top, 12, bottom - top);
  g.fillStyle = mixed("--cold", "--hot", share);
  g.fillRect(x, bottom - share * (bottom - top), 12, share * (bottom - top));
  text(g, `${(pressure / 1e5).toFixed(1)} bar`, width - 2, 22, "--ink", "right");
  text(g, "0", x - 5, bottom, "--soft", "right");
  text(g, round(full / 1e5), x - 5, top, "--soft", "right");
}

// The stroke is enlarged: its scale is beside it.
function drawMuscle(canvas, episode, row) {
  const { g, width, height } = context(canvas);
  const at = (name) => episode.signal(name)[row], full = episode.scene.full;
  const x = Math.round(0.46 * width), top = 34, rest = 0.57 * height;
  const perMetre = (0.3 * height) / 0.016, contraction = at("state/contraction");
  const end = top + rest - contraction * perMetre, share = at("state/pressure") / full;
  fill(g, [[x - 60, 16], [x + 60, 16], [x + 60, 24], [x - 60, 24]], ink("--steel"));
  stroke(g, [[x, 24], [x, top]], ink("--steel"), 6);
  const tint = mixed("--cold", "--hot", share), n = 40;
  const radius = 17 * (1 + 42 * Math.max(0, contraction)), left = [], right = [];
  for (let k = 0; k <= n; k++) {
    const u = k / n, y = top + u * (end - top);
    const r = 9 + (radius - 9) * Math.min(1, 2.2 * Math.sin(Math.PI * u)) ** 0.7;
    left.push([x - r, y]);
    right.unshift([x + r, y]);
  }
  fill(g, [...left, ...right], tint);
  for (let k = 0; k < 8; k++)
    for (const way of [1, -1]) {
      const thread = [];
      for (let i = 0; i <= n; i++) {
        const a = 2 * Math.PI * ((way * 2.2 * i) / n + k / 8);
        if (Math.cos(a) > 0) thread.push([x + (left[i][0] - x) * Math.sin(a), left[i][1]]);
        else if (thread.length > 1) stroke(g, thread.splice(0), mixed("--thread", "--paper", 0.1), 0.8);
        else thread.length = 0;
      }
      if (thread.length > 1) stroke(g, thread, mixed("--thread", "--paper", 0.1), 0.8);
    }
  const load = at("state/load"), side = load > 0.005 ? 14 + 22 * Math.cbrt(load / 5) : 0;
  stroke(g, [[x, end], [x, end + 22]], ink("--steel"), 6);
  if (side)
    fill(
      g,
      [[x - 0.7 * side, end + 22], [x + 0.7 * side, end + 22], [x + side, end + 22 + 1.2 * side],
        [x - side, end + 22 + 1.2 * side]],
      ink("--steel"),
    );
  text(g, side ? `${load.toFixed(2)} kg` : "no load", x, end + 32 + 1.2 * side, "--ink", "center");
  const ruler = x - 66, level = (metres) => top + rest + 22 - metres * perMetre;
  for (let mm = 0; mm <= 15; mm++) {
    stroke(g, [[ruler, level(mm / 1e3)], [ruler + (mm % 5 ? 5 : 9), level(mm / 1e3)]], ink("--soft"), 1);
    if (mm % 5 === 0) text(g, String(mm), ruler - 6, level(mm / 1e3), "--soft", "right");
  }
  stroke(g, [[ruler, level(0)], [ruler, level(0.015)]], ink("--soft"), 1);
  text(g, "mm", ruler, level(0.015) - 14, "--soft", "center");
  const aim = level(at("reference")), now = level(at("output"));
  stroke(g, [[ruler + 14, aim], [x + 62, aim]], ink("--wanted"), 1.6, [5, 4]);
  text(g, "reference", x + 66, aim, "--wanted");
  fill(g, [[ruler + 12, now], [ruler + 22, now - 5], [ruler + 22, now + 5]], ink("--ours"));
  gauge(g, width, height, at("state/pressure"), full);
}

const along = ([x, y], angle, length) => [x + length * Math.sin(angle), y + length * Math.cos(angle)];

function limb(g, a, b, wide, narrow, color) {
  const angle = Math.atan2(b[0] - a[0], b[1] - a[1]) + Math.PI / 2;
  const across = (p, w) => [along(p, angle, w / 2), along(p, angle, -w / 2)];
  const [a1, a2] = across(a, wide), [b1, b2] = across(b, narrow);
  fill(g, [a1, b1, b2, a2], color);
  for (const [p, w] of [[a, wide], [b, narrow]]) {
    g.beginPath();
    g.arc(p[0], p[1], w / 2, 0, 7);
    g.fill();
  }
}

function drawLeg(canvas, episode, row) {
  const { g, width, height } = context(canvas);
  const at = (name) => episode.signal(name)[row], { thigh, shank, arm } = episode.scene.leg;
  const scale = (height - 84) / (thigh + shank + 0.09), stance = at("state/stance") > 0.5;
  const off = at("state/deviation"), lower = -at("state/shank") - 0.5 * off;
  const upper = lower + at("state/knee") + off, ground = height - 40;
  const foot = -at("state/shank") + Math.PI / 2 + at("state/ankle");
  const posed = (hip) => {
    const knee = along(hip, upper, scale * thigh), ankle = along(knee, lower, scale * shank);
    const heel = along(ankle, foot - 2.4, 0.085 * scale), toe = along(ankle, foot - 0.32, 0.19 * scale);
    return { hip, knee, ankle, heel, toe };
  };
  let { hip, knee, ankle, heel, toe } = posed([Math.round(0.4 * width), 30]);
  if (stance) ({ hip, knee, ankle, heel, toe } = posed([hip[0], 30 + ground - Math.max(heel[1], toe[1])]));
  stroke(g, [[16, ground], [width - 50, ground]], ink("--rule"), 2);
  const skin = ink("--skin");
  limb(g, hip, knee, 0.11 * scale, 0.075 * scale, skin);
  limb(g, knee, ankle, 0.075 * scale, 0.045 * scale, skin);
  fill(g, [ankle, heel, toe], stance ? ink("--steel") : mixed("--steel", "--paper", 0.4));
  stroke(g, [knee, along(knee, lower + off, scale * shank)], ink("--wanted"), 1.6, [5, 4]);
  const middle = 0.5 * (upper + Math.PI + lower), half = 0.5 * at("state/angle");
  const ends = [1, -1].map((way) => along(knee, middle + way * half, scale * arm));
  for (const end of ends) stroke(g, [knee, end], ink("--steel"), 3);
  const share = at("state/pressure") / episode.scene.full;
  const bulge = 5 + 30 * Math.max(0, 0.27 - at("state/length"));
  limb(g, ends[0], ends[1], bulge, bulge, mixed("--cold", "--hot", share));
  for (const end of [...ends, knee]) {
    g.fillStyle = ink("--ink");
    g.beginPath();
    g.arc(end[0], end[1], 4, 0, 7);
    g.fill();
  }
  const force = at("state/ground_force");
  if (force > 1) {
    const from = [ankle[0] + scale * at("state/cop"), ground];
    const tip = [from[0] + 0.08 * at("state/ground_force_ahead"), ground - 0.08 * force];
    stroke(g, [from, tip], ink("--third"), 2.5);
    text(g, `${force.toFixed(0)} N`, tip[0] + 12, Math.max(tip[1], 44), "--third");
  }
  const phase = at("state/phase");
  text(g, `${stance ? "stance" : "swing"}, ${Math.round(100 * phase)} % of the stride`, 16, height - 14, "--ink");
  gauge(g, width, height, at("state/pressure"), episode.scene.full);
}
