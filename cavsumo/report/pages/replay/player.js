// Plays an episode: one state (what time it is, what is in view), drawn anew whenever it changes.
"use strict";
(() => {
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($("episode").textContent);
  const MILLI = 1e-3, CENTI = 1e-2, ANGLE = 1e-4; // units of packed numbers, see packing.py
  const TTC_MOST = 10, GAP_MOST = 40; // the graphs end there [s], [m]
  const SPEEDS = Array.from($("speed").options, (option) => Number(option.value));
  const LABELS = { car: "car", truck: "truck", bus: "bus", bicycle: "bicycle", pedestrian: "pedestrian" };

  // Data

  function numbers(text) { // the inverse of packing.packed
    const raw = atob(text), values = [];
    let last = 0, code = 0, factor = 1;
    for (let i = 0; i < raw.length; i++) {
      const byte = raw.charCodeAt(i);
      code += (byte & 127) * factor;
      factor *= 128;
      if (byte < 128) {
        last += code % 2 ? -(code + 1) / 2 : code / 2;
        values.push(last);
        code = 0;
        factor = 1;
      }
    }
    return values;
  }

  function shapes(packed) { // lists of points [x, y, x, y, ...] in metres
    const sizes = numbers(packed.sizes), points = numbers(packed.points), n = points.length / 2;
    let at = 0;
    return sizes.map((size) => {
      const flat = new Float64Array(2 * size);
      for (let i = 0; i < size; i++, at++) {
        flat[2 * i] = points[at] * CENTI;
        flat[2 * i + 1] = points[n + at] * CENTI;
      }
      return flat;
    });
  }

  function track(body) {
    const flat = numbers(body.way), n = flat.length / 4;
    const column = (i, unit) => Float64Array.from(flat.slice(i * n, (i + 1) * n), (v) => v * unit);
    return { ...body, count: n, x: column(0, MILLI), y: column(1, MILLI), v: column(2, MILLI), o: column(3, ANGLE) };
  }

  const bodies = data.bodies.map(track);
  const ego = bodies[0];
  const last = data.count - 1;
  const zones = { braking: shapes(data.zones.braking), reaction: shapes(data.zones.reaction) };
  const value = (v) => (v < 0 ? NaN : v * MILLI);
  const curves = {
    speed: numbers(data.speed).map(value),
    gap: numbers(data.gap).map(value),
    ttc: numbers(data.ttc).map(value),
  };
  const stops = numbers(data.scene.lights);
  const letters = numbers(data.lights);
  const lightCount = stops.length / 4;

  function here(body, time) { // [x, y, v, o] at a time in timesteps, between frames too; or null
    const at = time - body.first;
    if (at < 0 || at > body.count - 1) return null;
    const i = Math.floor(at), j = Math.min(i + 1, body.count - 1), t = at - i;
    const mix = (values) => values[i] + t * (values[j] - values[i]);
    let turn = body.o[j] - body.o[i];
    if (turn > Math.PI) turn -= 2 * Math.PI;
    if (turn < -Math.PI) turn += 2 * Math.PI;
    return [mix(body.x), mix(body.y), mix(body.v), body.o[i] + t * turn];
  }

  // State

  const narrow = window.matchMedia("(max-width: 860px)");
  const state = { time: 0, playing: false, rate: 1, follow: narrow.matches, zoom: 1, dx: 0, dy: 0 };
  const drawn = { costs: [], intervals: [], scale: 1, cx: 0, cy: 0 };
  const frameNow = () => Math.round(state.time);

  // View

  const map = $("map");
  const pen = map.getContext("2d");
  let colours = {}, scheme = 0; // and how often they have changed

  const dark = window.matchMedia("(prefers-color-scheme: dark)");

  function readColours() {
    scheme += 1;
    document.documentElement.dataset.scheme = dark.matches ? "dark" : "light";
    const style = getComputedStyle(document.documentElement);
    const names = ("ground road other pavement walking line stripes borders route ego tester vehicle pedestrian " +
      "glass braking reaction outline red yellow green ink soft edge panel accent").split(" ");
    colours = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  }

  function path(parts, closed) {
    const made = new Path2D();
    for (const flat of parts) {
      for (let i = 0; i < flat.length; i += 2) made[i ? "lineTo" : "moveTo"](flat[i], flat[i + 1]);
      if (closed && flat.length) made.closePath();
    }
    return made;
  }

  const areas = Object.fromEntries(Object.entries(data.scene.areas).map(([k, v]) => [k, path(shapes(v), true)]));
  const lines = Object.fromEntries(Object.entries(data.scene.lines).map(([k, v]) => [k, path(shapes(v), false)]));

  const extent = (() => { // of what matters: the ego's route and the testers' ways
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    const take = (x, y) => {
      box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y);
      box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y);
    };
    for (const body of bodies.filter((b) => b.part !== "background")) body.x.forEach((x, i) => take(x, body.y[i]));
    for (const flat of zones.reaction) for (let i = 0; i < flat.length; i += 2) take(flat[i], flat[i + 1]);
    return [box[0] - 8, box[1] - 8, box[2] + 8, box[3] + 8];
  })();

  function fit() { // a canvas as many pixels as the screen shows of it
    for (const canvas of document.querySelectorAll("canvas")) {
      const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
      canvas.width = Math.max(1, Math.round(box.width * ratio));
      canvas.height = Math.max(1, Math.round(box.height * ratio));
    }
    draw();
  }

  function wholeScale() {
    return Math.min(map.width / (extent[2] - extent[0]), map.height / (extent[3] - extent[1]));
  }

  function look() { // scale [pixels per metre] and centre
    const whole = wholeScale();
    const closest = 14 * (window.devicePixelRatio || 1);
    const base = state.follow ? Math.max(whole, Math.min(closest, map.width / 55)) : whole;
    const scale = base * state.zoom;
    let x = (extent[0] + extent[2]) / 2, y = (extent[1] + extent[3]) / 2;
    if (state.follow) {
      [x, y] = here(ego, state.time);
    }
    Object.assign(drawn, { scale, cx: x + state.dx, cy: y + state.dy });
  }

  const toScreen = (x, y) => [
    map.width / 2 + (x - drawn.cx) * drawn.scale,
    map.height / 2 - (y - drawn.cy) * drawn.scale,
  ];

  function worldPen(pen) {
    const s = drawn.scale;
    pen.setTransform(s, 0, 0, -s, map.width / 2 - drawn.cx * s, map.height / 2 + drawn.cy * s);
  }

  // Drawing

  const still = {}; // pictures of what stands still, by name

  function backdrop(name, pen, key, paint) { // paints it only when its key changes
    const { width, height } = pen.canvas, whole = [width, height, scheme, ...key].join(" ");
    const it = (still[name] ||= { canvas: document.createElement("canvas") });
    if (it.key !== whole) {
      Object.assign(it, { key: whole });
      Object.assign(it.canvas, { width, height });
      paint(it.canvas.getContext("2d"));
    }
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.drawImage(it.canvas, 0, 0);
  }

  function drawScene(pen) {
    const pixel = (window.devicePixelRatio || 1) / drawn.scale; // m
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.fillStyle = colours.ground;
    pen.fillRect(0, 0, map.width, map.height);
    worldPen(pen);
    pen.lineJoin = "round";
    for (const name of ["pavement", "other", "road", "walking"]) {
      pen.fillStyle = pen.strokeStyle = colours[name];
      pen.lineWidth = Math.max(0.12, 0.8 * pixel); // closes the seams between lanes
      pen.fill(areas[name], "nonzero");
      pen.stroke(areas[name]);
    }
    pen.fillStyle = colours.stripes;
    pen.fill(areas.stripes);
    pen.lineWidth = Math.max(0.14, 0.9 * pixel);
    pen.strokeStyle = colours.borders;
    pen.setLineDash([0.5, 0.3]);
    pen.stroke(lines.borders);
    pen.strokeStyle = colours.line;
    pen.setLineDash([]);
    pen.stroke(lines.solid);
    pen.setLineDash([3, 3]);
    pen.stroke(lines.dashed);
    pen.setLineDash([1.2, 1.2]);
    pen.globalAlpha = 0.45;
    pen.lineWidth = Math.max(0.15, pixel);
    pen.strokeStyle = colours.route;
    pen.stroke(lines.route);
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }

  const SHOWN = { G: "green", g: "green", y: "yellow", Y: "yellow", r: "red", R: "red", u: "yellow" };

  function light(frame, i) {
    return letters.length ? String.fromCharCode(letters[frame * lightCount + i]) : "";
  }

  function drawLights(frame) {
    if (letters.length < (frame + 1) * lightCount) return;
    const ratio = window.devicePixelRatio || 1;
    for (let i = 0; i < lightCount; i++) {
      const [ax, ay, bx, by] = [0, 1, 2, 3].map((k) => stops[k * lightCount + i] * CENTI);
      pen.strokeStyle = colours[SHOWN[light(frame, i)] || "soft"];
      pen.lineWidth = Math.max(0.5, 3 * ratio / drawn.scale);
      pen.beginPath();
      pen.moveTo(ax, ay);
      pen.lineTo(bx, by);
      pen.stroke();
    }
  }

  function drawZones(frame) { // as far from the ego as at the timestep, also between two of them
    const then = here(ego, frame), now = here(ego, state.time);
    pen.save();
    pen.translate(now[0], now[1]);
    pen.rotate(now[3] - then[3]);
    pen.translate(-then[0], -then[1]);
    for (const name of ["reaction", "braking"]) {
      const zone = path([zones[name][frame]], true);
      pen.fillStyle = pen.strokeStyle = colours[name];
      pen.globalAlpha = 0.42;
      pen.fill(zone);
      pen.globalAlpha = 0.95;
      pen.lineWidth = Math.max(0.06, 1.2 * (window.devicePixelRatio || 1) / drawn.scale);
      pen.stroke(zone);
      pen.globalAlpha = 1;
    }
    pen.restore();
  }

  function drawWay(body) {
    const upTo = Math.min(Math.floor(state.time) - body.first, body.count - 1);
    if (upTo < 0) return;
    pen.beginPath();
    for (let i = 0; i <= upTo; i++) pen.lineTo(body.x[i], body.y[i]);
    const now = here(body, state.time);
    if (now) pen.lineTo(now[0], now[1]);
    pen.strokeStyle = colours[body.part];
    pen.globalAlpha = 0.75;
    pen.lineWidth = Math.max(0.12, 1.6 * (window.devicePixelRatio || 1) / drawn.scale);
    pen.stroke();
    pen.globalAlpha = 1;
  }

  const walks = (body) => body.kind === "pedestrian";

  function colourOf(body) {
    if (body.part !== "background") return colours[body.part];
    return walks(body) ? colours.pedestrian : colours.vehicle;
  }

  function drawBody(body, pose) {
    const [x, y, v, o] = pose, [length, width] = body.size;
    const ratio = window.devicePixelRatio || 1, pixel = ratio / drawn.scale;
    pen.save();
    pen.translate(x, y);
    pen.rotate(o);
    pen.fillStyle = colourOf(body);
    const large = width > 8 * pixel; // else its box alone
    if (width < 4 * pixel) { // hardly seen: a pale spot behind the box
      pen.globalAlpha = 0.45;
      pen.beginPath();
      pen.arc(0, 0, 3 * pixel, 0, 2 * Math.PI);
      pen.fill();
      pen.globalAlpha = 1;
    }
    pen.strokeStyle = colours.outline;
    pen.lineWidth = Math.min(0.12, pixel);
    pen.beginPath();
    pen.roundRect(-length / 2, -width / 2, length, width, walks(body) ? 0 : Math.min(0.35, width / 4));
    pen.fill();
    if (large) pen.stroke();
    if (!large && body !== ego) {
      // no room for more
    } else if (walks(body)) {
      pen.fillStyle = colours.outline;
      pen.beginPath();
      pen.arc(0, 0, width * 0.22, 0, 2 * Math.PI);
      pen.fill();
    } else if (width < 1.2) { // a bicycle: its frame
      pen.fillStyle = colours.outline;
      pen.fillRect(-length * 0.35, -0.06, length * 0.7, 0.12);
      pen.fillRect(length * 0.2, -width * 0.35, 0.12, width * 0.7);
    } else {
      pen.fillStyle = colours.glass;
      const front = length / 2 - Math.min(1.5, length * 0.32);
      pen.fillRect(front, -width * 0.4, Math.min(0.8, length * 0.18), width * 0.8);
      if (body === ego && braking()) {
        pen.fillStyle = colours.red;
        pen.fillRect(-length / 2, -width / 2, 0.35, width * 0.3);
        pen.fillRect(-length / 2, width * 0.2, 0.35, width * 0.3);
      }
    }
    pen.restore();
  }

  function braking() {
    const i = Math.min(Math.floor(state.time), last);
    return i > 0 && (ego.v[i - 1] - ego.v[i]) / data.dt > 0.7;
  }

  function drawRings() { // a body is small in the whole view, so testers have rings
    const ratio = window.devicePixelRatio || 1;
    const hit = data.marks.find((mark) => mark.name === "violation");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    for (const body of bodies.filter((b) => b.part === "tester")) {
      const pose = here(body, state.time);
      if (!pose) continue;
      const [x, y] = toScreen(pose[0], pose[1]);
      const struck = hit && body.id === data.tester && state.time * data.dt >= hit.time - 1e-9;
      const radius = Math.max(6 * ratio, 0.62 * Math.hypot(...body.size) * drawn.scale);
      pen.strokeStyle = struck ? colours.braking : colours.tester;
      pen.lineWidth = (struck ? 2.6 : 1.4) * ratio;
      pen.beginPath();
      pen.arc(x, y, radius, 0, 2 * Math.PI);
      pen.stroke();
    }
    label(ego);
    bodies.filter((b) => b.part === "tester").forEach(label);
  }

  function label(body) {
    const pose = here(body, state.time), ratio = window.devicePixelRatio || 1;
    if (!pose) return;
    const [x, y] = toScreen(pose[0], pose[1]);
    const off = Math.max(9 * ratio, 0.5 * Math.min(body.size[0], 3) * drawn.scale + 6 * ratio);
    const side = body === ego ? 1.1 : -0.8; // the ego's below it, the testers' above
    const text = body.id.length > 24 ? `${body.id.slice(0, 23)}…` : body.id;
    pen.font = `600 ${11 * ratio}px system-ui, sans-serif`;
    pen.textBaseline = "middle";
    pen.lineWidth = 3 * ratio;
    pen.lineJoin = "round";
    pen.strokeStyle = colours.panel;
    pen.strokeText(text, x + off * 0.8, y + off * side);
    pen.fillStyle = colourOf(body);
    pen.fillText(text, x + off * 0.8, y + off * side);
  }

  function drawScaleBar() {
    const ratio = window.devicePixelRatio || 1, wanted = 110 * ratio / drawn.scale;
    const unit = 10 ** Math.floor(Math.log10(wanted));
    const length = [5, 2, 1].map((k) => k * unit).find((m) => m <= wanted);
    const x = 12 * ratio, y = map.height - 12 * ratio, w = length * drawn.scale;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    for (const [colour, width] of [[colours.panel, 5], [colours.ink, 1.6]]) {
      pen.strokeStyle = colour;
      pen.lineWidth = width * ratio;
      pen.beginPath();
      pen.moveTo(x, y - 5 * ratio);
      pen.lineTo(x, y);
      pen.lineTo(x + w, y);
      pen.lineTo(x + w, y - 5 * ratio);
      pen.stroke();
    }
    pen.font = `${11 * ratio}px system-ui, sans-serif`;
    pen.textBaseline = "bottom";
    pen.lineWidth = 3 * ratio;
    pen.strokeStyle = colours.panel;
    pen.strokeText(`${length} m`, x + 5 * ratio, y - 3 * ratio);
    pen.fillStyle = colours.ink;
    pen.fillText(`${length} m`, x + 5 * ratio, y - 3 * ratio);
  }

  function draw() {
    const begun = performance.now(), frame = frameNow();
    look();
    if (state.follow && state.playing) drawScene(pen);
    else backdrop("scene", pen, [drawn.scale, drawn.cx, drawn.cy], drawScene);
    worldPen(pen);
    drawLights(frame);
    for (const body of bodies) if (body.part !== "background") drawWay(body);
    drawZones(frame);
    for (let i = bodies.length - 1; i >= 0; i--) { // the ego is the first, so it comes last
      const pose = here(bodies[i], state.time);
      if (pose) drawBody(bodies[i], pose);
    }
    drawRings();
    drawScaleBar();
    for (const graph of graphs) drawGraph(graph);
    tell(frame);
    keep(drawn.costs, performance.now() - begun);
  }

  function keep(list, value) {
    list.push(value);
    if (list.length > 2000) list.shift();
  }

  // Graphs

  const nice = (most, steps = [1, 2, 5, 10]) => { // the next round number
    const unit = 10 ** Math.floor(Math.log10(Math.max(most, 1e-3)));
    return steps.map((k) => k * unit).find((v) => v >= most - 1e-9);
  };
  const most = (values, limit) =>
    Math.min(limit, nice(values.reduce((a, v) => (v > a ? v : a), 0.5), [1, 1.2, 1.6, 2, 3, 4, 6, 8, 10]));
  const graphs = [
    { name: "speed", unit: "m/s", top: most(curves.speed, 100), colour: "ego" },
    { name: "gap", unit: "m", top: most(curves.gap, GAP_MOST), colour: "tester" },
    { name: "ttc", unit: "s", top: most(curves.ttc, TTC_MOST), colour: "pedestrian" },
  ].map((graph) => ({ ...graph, canvas: $(`${graph.name}-graph`), values: curves[graph.name] }));

  function frameOf(graph) { // the plot's edges in device pixels
    const ratio = window.devicePixelRatio || 1;
    return { left: 30 * ratio, right: graph.canvas.width - 8 * ratio, top: 8 * ratio, bottom: graph.canvas.height - 17 * ratio, ratio };
  }

  function drawGraph(graph) {
    const ink = graph.canvas.getContext("2d"), box = frameOf(graph), { ratio } = box;
    const x = (i) => box.left + (box.right - box.left) * (last ? i / last : 0);
    const y = (v) => box.bottom - (box.bottom - box.top) * Math.min(v, graph.top) / graph.top;
    backdrop(graph.name, ink, [], (pen) => drawPlot(pen, graph, box, x, y));
    const now = x(state.time), v = graph.values[frameNow()];
    ink.strokeStyle = colours.ink;
    ink.lineWidth = 1.2 * ratio;
    line(ink, now, box.top - 4 * ratio, now, box.bottom);
    if (v >= 0 && v <= graph.top) {
      ink.fillStyle = colours[graph.colour];
      ink.beginPath();
      ink.arc(now, y(v), 3.6 * ratio, 0, 2 * Math.PI);
      ink.fill();
    }
  }

  function drawPlot(ink, graph, box, x, y) { // axes, marks and the curve
    const { ratio } = box;
    ink.font = `${10.5 * ratio}px system-ui, sans-serif`;
    ink.lineWidth = ratio;
    ink.strokeStyle = colours.edge;
    ink.fillStyle = colours.soft;
    ink.textAlign = "right";
    ink.textBaseline = "middle";
    for (const v of [0, graph.top / 2, graph.top]) {
      line(ink, box.left, y(v), box.right, y(v));
      ink.fillText(`${Number(v.toPrecision(3))}`, box.left - 5 * ratio, y(v));
    }
    ink.textAlign = "center";
    ink.textBaseline = "top";
    const seconds = last * data.dt, step = Math.max(nice(seconds / 6), 0.1);
    for (let t = 0; t <= seconds + 1e-9; t += step) {
      const at = x(t / data.dt);
      line(ink, at, box.bottom, at, box.bottom + 3 * ratio);
      if (at < box.right - 14 * ratio || t === 0) ink.fillText(`${Number(t.toFixed(1))}`, at, box.bottom + 4 * ratio);
    }
    ink.textAlign = "right";
    ink.fillText("s", box.right + 4 * ratio, box.bottom + 4 * ratio);
    for (const mark of data.marks) {
      ink.strokeStyle = colours[mark.name === "violation" ? "braking" : "reaction"];
      ink.lineWidth = 1.6 * ratio;
      ink.setLineDash([4 * ratio, 3 * ratio]);
      line(ink, x(mark.time / data.dt), box.top, x(mark.time / data.dt), box.bottom);
      ink.setLineDash([]);
    }
    drawCurve(ink, graph, x, y, ratio);
  }

  function drawCurve(ink, graph, x, y, ratio) {
    ink.strokeStyle = colours[graph.colour];
    ink.lineWidth = 1.8 * ratio;
    ink.lineJoin = "round";
    ink.beginPath();
    let down = false;
    graph.values.forEach((v, i) => { // above the top is out of sight, not at the top
      const seen = v <= graph.top;
      if (seen) ink[down ? "lineTo" : "moveTo"](x(i), y(v));
      down = seen;
    });
    ink.stroke();
  }

  function line(ink, ax, ay, bx, by) {
    ink.beginPath();
    ink.moveTo(ax, ay);
    ink.lineTo(bx, by);
    ink.stroke();
  }

  // Words

  const figure = (v, unit, digits = 1) => (v >= 0 ? `${v.toFixed(digits)} ${unit}` : "none");
  const seconds = (frame) => (frame * data.dt).toFixed(data.dt < 0.1 ? 2 : 1);

  function tell(frame) {
    const scrub = $("scrub");
    scrub.value = frame;
    scrub.setAttribute("aria-valuetext", `${seconds(frame)} seconds`);
    $("clock").textContent = `${seconds(frame)} / ${seconds(last)} s`;
    for (const graph of graphs) $(`${graph.name}-now`).textContent = figure(graph.values[frame], graph.unit);
    map.dataset.frame = frame;
    map.dataset.playing = state.playing;
  }

  function showPlaying() {
    $("play").setAttribute("aria-label", state.playing ? "Pause" : "Play");
    $("play").title = state.playing ? "Pause (space)" : "Play (space)";
    $("sign").setAttribute("d", state.playing ? "M4 2h3v12H4zM9 2h3v12H9z" : "M4 2l10 6-10 6z");
  }

  function say() {
    const frame = frameNow();
    $("said").textContent = `${seconds(frame)} seconds: speed ${figure(curves.speed[frame], "m/s")}, ` +
      `gap ${figure(curves.gap[frame], "m")}, time to collision ${figure(curves.ttc[frame], "s")}`;
  }

  // What one can do

  function seek(frame) {
    state.time = Math.min(last, Math.max(0, Math.round(frame)));
    draw();
    if (!state.playing) say();
  }

  let before = null;

  function play(on) {
    if (on && state.time >= last) state.time = 0;
    state.playing = on && last > 0;
    before = null;
    if (!state.playing) state.time = frameNow();
    showPlaying();
    if (state.playing) requestAnimationFrame(tick);
    else say();
    draw();
  }

  function tick(now) {
    if (!state.playing) return;
    if (before !== null) {
      keep(drawn.intervals, now - before);
      state.time += Math.min(now - before, 250) / 1000 * state.rate / data.dt;
    }
    before = now;
    if (state.time >= last) {
      state.time = last;
      play(false);
      return;
    }
    draw();
    requestAnimationFrame(tick);
  }

  function step(frames) {
    if (state.playing) play(false);
    seek(state.time + frames);
  }

  function setRate(rate) {
    state.rate = rate;
    $("speed").value = String(rate);
  }

  function view(follow) {
    Object.assign(state, { follow, zoom: 1, dx: 0, dy: 0 });
    $("follow").setAttribute("aria-pressed", String(follow));
    $("whole").setAttribute("aria-pressed", String(!follow));
    draw();
  }

  function zoom(factor, x = map.width / 2, y = map.height / 2) { // about a point of the canvas
    const old = state.zoom;
    state.zoom = Math.min(40, Math.max(0.2, state.zoom * factor));
    const gain = 1 / drawn.scale - old / (drawn.scale * state.zoom);
    state.dx += (x - map.width / 2) * gain;
    state.dy -= (y - map.height / 2) * gain;
    if (state.follow) state.dx = state.dy = 0;
    draw();
  }

  const KEYS = {
    " ": () => play(!state.playing),
    ArrowRight: (event) => step(event.shiftKey ? 1 / data.dt : 1),
    ArrowLeft: (event) => step(event.shiftKey ? -1 / data.dt : -1),
    Home: () => step(-Infinity),
    End: () => step(Infinity),
    ArrowUp: () => setRate(SPEEDS[Math.min(SPEEDS.indexOf(state.rate) + 1, SPEEDS.length - 1)]),
    ArrowDown: () => setRate(SPEEDS[Math.max(SPEEDS.indexOf(state.rate) - 1, 0)]),
    "+": () => zoom(1.25),
    "=": () => zoom(1.25),
    "-": () => zoom(0.8),
    f: () => view(true),
    w: () => view(false),
  };

  document.addEventListener("keydown", (event) => {
    const tag = event.target.tagName, key = KEYS[event.key];
    if (!key || event.ctrlKey || event.metaKey || event.altKey || tag === "SELECT") return;
    if (tag === "BUTTON" && event.key === " ") return; // it presses the button
    event.preventDefault();
    key(event);
  });

  $("play").onclick = () => play(!state.playing);
  $("start").onclick = () => step(-Infinity);
  $("end").onclick = () => step(Infinity);
  $("back").onclick = () => step(-1);
  $("forward").onclick = () => step(1);
  $("scrub").oninput = (event) => step(Number(event.target.value) - state.time);
  $("speed").onchange = (event) => setRate(Number(event.target.value));
  $("whole").onclick = () => view(false);
  $("follow").onclick = () => view(true);
  $("closer").onclick = () => zoom(1.25);
  $("farther").onclick = () => zoom(0.8);

  // Fingers and mouse: one drags the map, two zoom it; in a graph one seeks

  const fingers = new Map();

  function place(event) {
    const box = map.getBoundingClientRect(), ratio = map.width / box.width;
    return [(event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio];
  }

  map.addEventListener("pointerdown", (event) => {
    map.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, place(event));
  });
  map.addEventListener("pointermove", (event) => {
    const was = fingers.get(event.pointerId), is = place(event);
    if (!was) return;
    const other = [...fingers].find(([id]) => id !== event.pointerId);
    fingers.set(event.pointerId, is);
    if (other) {
      const apart = (a) => Math.hypot(a[0] - other[1][0], a[1] - other[1][1]);
      zoom(apart(is) / Math.max(1, apart(was)), other[1][0], other[1][1]);
      return;
    }
    state.dx -= (is[0] - was[0]) / drawn.scale;
    state.dy += (is[1] - was[1]) / drawn.scale;
    draw();
  });
  for (const end of ["pointerup", "pointercancel"]) {
    map.addEventListener(end, (event) => fingers.delete(event.pointerId));
  }
  map.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-event.deltaY * 0.0015), ...place(event));
  }, { passive: false });

  for (const graph of graphs) {
    const there = (event) => {
      const box = graph.canvas.getBoundingClientRect(), plot = frameOf(graph);
      const at = (event.clientX - box.left) * graph.canvas.width / box.width;
      return last * (at - plot.left) / (plot.right - plot.left);
    };
    graph.canvas.addEventListener("pointerdown", (event) => {
      graph.canvas.setPointerCapture(event.pointerId);
      step(there(event) - state.time);
    });
    graph.canvas.addEventListener("pointermove", (event) => {
      if (event.buttons & 1) step(there(event) - state.time);
    });
  }

  // What depends on the episode

  for (const mark of data.marks) {
    const tick = document.createElement("span"), button = document.createElement("button");
    tick.className = mark.name;
    tick.style.left = `${last ? 100 * mark.time / data.dt / last : 0}%`;
    $("marks").append(tick);
    button.type = "button";
    button.textContent = `${mark.name} ${mark.time.toFixed(1)} s`;
    button.style.setProperty("--mark", `var(--${mark.name === "violation" ? "braking" : "reaction"})`);
    button.onclick = () => step(mark.time / data.dt - state.time);
    $("jumps").append(button);
  }

  const kinds = [...new Set(bodies.filter((b) => b.part === "background").map((b) => (walks(b) ? "pedestrian" : "vehicle")))];
  const legend = [["ego", "ego"], ["tester", "testers"], ["braking", "braking zone"], ["reaction", "reaction zone"]]
    .concat(kinds.map((kind) => [kind, `other ${kind}s`]), [["route", "ego's route, ways so far"]]);
  for (const [colour, words] of legend) {
    const item = document.createElement("li"), swatch = document.createElement("i");
    swatch.style.background = `var(--${colour})`;
    if (colour === "route") swatch.style.height = "3px";
    item.append(swatch, words);
    $("legend").append(item);
  }

  // For whoever wants to look inside: read only

  window.cavsumo = Object.freeze({
    get time() { return state.time; },
    get frame() { return frameNow(); },
    get playing() { return state.playing; },
    get rate() { return state.rate; },
    get view() { return { follow: state.follow, zoom: state.zoom, ...drawn, costs: undefined, intervals: undefined }; },
    get costs() { return drawn.costs.slice(); }, // ms that each drawing took
    get intervals() { return drawn.intervals.slice(); }, // ms from drawing to drawing while playing
    get bodies() {
      return Object.fromEntries(bodies.map((b) => [b.id, here(b, frameNow())]).filter(([, pose]) => pose));
    },
    get lights() { return Array.from({ length: lightCount }, (_, i) => light(frameNow(), i)).join(""); },
    get zones() { return { braking: [...zones.braking[frameNow()]], reaction: [...zones.reaction[frameNow()]] }; },
    get curves() { const i = frameNow(); return { speed: curves.speed[i], gap: curves.gap[i], ttc: curves.ttc[i] }; },
    screen: (x, y) => { const ratio = map.width / map.getBoundingClientRect().width; return toScreen(x, y).map((v) => v / ratio); },
    count: data.count,
  });

  readColours();
  dark.addEventListener("change", () => { readColours(); draw(); });
  new ResizeObserver(fit).observe($("stage"));
  window.addEventListener("resize", fit);
  fit();
  view(state.follow);
})();
