// The page of `rotor view`: spectrum, prediction and assignment. One ES module, for the server, for exported pages and for notebooks.
// It draws with BokehJS (globalThis.Bokeh); everything that is computed comes from Python through a transport (docs/view.md).

const PALETTE = {
  light: ["#0072b2", "#c04e01", "#007a5a", "#a3447e", "#8a6100", "#00708f", "#555555"],
  dark: ["#56b4e9", "#f28e3c", "#2ec49a", "#e59ac8", "#e6b43c", "#8fd3e8", "#c0c0c0"],
}; // Okabe and Ito's colours, darkened or lightened until each has a contrast of 4.5 with its background
const MARKS = ["circle", "square", "diamond", "triangle", "inverted_triangle", "hex", "star"];
const PEN = {
  light: { paper: "#ffffff", ink: "#1b1f24", grid: "#e3e6ea", trace: "#30363d", mark: "#b35900", select: "#0072b2" },
  dark: { paper: "#14171a", ink: "#e6e8ea", grid: "#2c3136", trace: "#c9d1d9", mark: "#ffb454", select: "#56b4e9" },
};
const KEYS = [
  ["← →", "move along the spectrum (Shift: a whole window)"], ["+ −", "zoom in and out (↑ ↓ too)"], ["0", "the whole band"],
  ["n p", "next, previous predicted line"], ["] [", "next, previous assigned line"], ["f", "fit the peak at the middle of the window"],
  ["Enter", "assign the fitted peak to the marked lines"], ["a", "drag selects a peak instead of moving"],
    ["x", "reject or accept the selected line"],
  ["Delete", "remove the selected line"], ["r", "refit"], ["u, Ctrl+Z", "undo"], ["y, Ctrl+Y", "redo"],
    ["w", "open or close a second window"],
  ["m", "prediction mirrored or overlaid"], ["s", "height of the sticks: of this window or of the whole band"],
    ["l", "residuals or Loomis-Wood rows"], ["PageDown PageUp", "next, previous Loomis-Wood row (f fits its peak)"],
  ["1 … 5", "panels"], ["t", "light or dark"], ["? Esc", "show, hide these keys"],
];
const EXPORTS = [
  ["lin", "Lines (.lin)"], ["csv", "Lines (.csv)"], ["par", "SPFIT input (.par)"], ["var", "SPCAT input (.var)"],
    ["toml", "Molecule file (.toml)"],
  ["scene", "Scene of the fit (.toml)"], ["fit", "Report of the fit"], ["md", "Table (Markdown)"], ["tex", "Table (LaTeX)"],
];
const ROWS = 50; // Loomis-Wood rows at once
const TABS = ["Assign", "Lines", "Constants", "Series", "Levels"];

// --- Small tools

function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "style") element.style.cssText = value;
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value != null) element.setAttribute(name, value);
  }
  element.append(...children.flat(3).filter((child) => child != null && child !== false));
  return element;
}
const fixed = (value, digits) => (value == null || !isFinite(value) ? "–" : value.toFixed(digits).replace("-", "−"));
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const SPECIES = { A: 0, E: 1, AA: 10, AE: 11, EA: 12, EE: 13, "EE*": 14 }; // of the permutations of turning groups
const quantum = (q, name, halves) => (halves.includes(name) ? (q % 2 ? `${q}/2` : `${q / 2}`)
  : name === "species" ? Object.keys(SPECIES).find((letter) => SPECIES[letter] === q) ?? `${q}` : `${q}`);
const HEAD = { j: "J", ka: "Ka", kc: "Kc", k: "K", n: "N", f: "F", vt: "vt", i_tot: "I", i_sym: "Γ" };
const headOf = (name) => HEAD[name] ?? name.replace(/^f(?=\d)/, "F");
const digitsOf = (error, value) => (error > 0 ? clamp(Math.ceil(-Math.log10(error)) + 1, 0, 12) : value && Math.abs(value) < 1 ? 9 : 4);
const short = (value) => (value >= 1e-4 && value < 1e5 ? value.toFixed(clamp(1 - Math.floor(Math.log10(value)), 0,
  9)) : value.toExponential(1));
const percent = (part) => (part >= 0.1 ? (100 * part).toFixed(0) : (100 * part).toPrecision(2));
const frame = () => new Promise((done) => requestAnimationFrame(done));

function number(word, name, halves) { // one quantum number: 3, 5/2 or 2.5 (stored doubled), E
  if (name === "species" && word in SPECIES) return SPECIES[word];
  const value = /^-?\d+\/2$/.test(word) ? parseInt(word, 10) / 2 : Number(word), stored = halves.includes(name) ? 2 * value : value;
  if (word === "" || !Number.isInteger(stored)) throw new Error(`'${word}': ${headOf(name)} is ${name === "species"
    ? Object.keys(SPECIES).join(", ") : halves.includes(name) ? "a half-integer such as 5/2, or a whole number" : "a whole number"}`);
  return stored;
}
function numbers(text, { names, halves }, step = false) { // "3 0 3", "3,0,3", of a step a difference in place of a letter
  const words = text.trim().split(/[\s,]+/).filter(Boolean);
  if (words.length !== names.length) throw new Error(`'${text}': ${names.length} quantum numbers are needed: ${names.map(headOf).join(" ")}`);
  return words.map((word, i) => number(word, step && names[i] === "species" ? "" : names[i], halves));
}

const CONDITION = /^([Δd]?)([a-z]\w*)(['"]?)(<=|>=|=|<|>)(-?[\d./]+|[AE]+\*?)$/i;
function fits(line, word, known) { // Ka=0, J">5, dJ=1: of the upper level, the lower one, their difference; null for other words
  const part = CONDITION.exec(word), i = part ? known.names.indexOf(part[2].toLowerCase()) : -1;
  if (i < 0) return null;
  const value = part[1] ? line.upper[i] - line.lower[i] : (part[3] === '"' ? line.lower : line.upper)[i];
  let than;
  try { than = number(part[5].toUpperCase(), part[1] ? known.names[i].replace("species", "") : known.names[i], known.halves); } catch { return false; }
  return { "=": value === than, "<": value < than, ">": value > than, "<=": value <= than, ">=": value >= than }[part[4]];
}
function inSeries(line, series) { // whether a line stands n steps from the first line of a series
  const { upper, lower, step } = series ?? {}, at = step?.findIndex((change) => change !== 0) ?? -1;
  if (at < 0 || line.species !== series.species) return false;
  const n = (line.upper[at] - upper[at]) / step[at];
  return Number.isInteger(n) && step.every((change, i) => line.upper[i] - upper[i] === n * change && line.lower[i] - lower[i] === n * change);
}

// --- Transports: call(message) gives an answer; onsession is called with the session after each change

export class SocketTransport {
  constructor(address) { this.address = address; this.waiting = new Map(); this.next = 1; this.onsession = () => {};
    this.onstatus = () => {}; this.live = true; }
  open() {
    return new Promise((done, fail) => {
      this.socket = new WebSocket(this.address);
      this.socket.onopen = () => { this.onstatus(""); done(); };
      this.socket.onerror = () => fail(new Error("no connection with the server"));
      this.socket.onmessage = (event) => this.receive(JSON.parse(event.data));
      this.socket.onclose = () => this.lost();
    });
  }
  lost() {
    for (const request of this.waiting.values()) request.fail(new Error("the connection with the server was lost"));
    this.waiting.clear();
    this.onstatus("The server does not answer; every finished action is saved. Trying again…");
    setTimeout(() => this.open().then(() => this.call({ do: "hello" })).then((answer) => this.onsession(answer.session)).catch(() => {}),
      1500);
  }
  receive(content) {
    if (content.session) return this.onsession(content.session);
    const request = this.waiting.get(content.re);
    this.waiting.delete(content.re);
    if (request) content.error ? request.fail(new Error(content.error)) : request.done(content);
  }
  call(message) {
    return new Promise((done, fail) => {
      if (this.socket.readyState !== WebSocket.OPEN) return fail(new Error("no connection with the server"));
      const id = this.next++;
      this.waiting.set(id, { done: (content) => { this.onnotes?.(content.notes ?? []); done(content.ok); }, fail });
      this.socket.send(JSON.stringify({ ...message, id }));
    });
  }
}

export class WidgetTransport extends SocketTransport {
  constructor(model) {
    super("");
    this.model = model;
    model.on("msg:custom", (content) => this.receive(content));
    this.socket = { readyState: WebSocket.OPEN, send: (text) => model.send(JSON.parse(text)) };
  }
  open() { return Promise.resolve(); }
}

export class StaticTransport { // an exported page: numbers inside, nothing computed but what is drawn
  constructor(data) { this.data = data; this.onsession = () => {}; this.onstatus = () => {}; this.live = false; this.x = floats(data.x);
    this.y = floats(data.y); }
  open() { return Promise.resolve(); }
  async call(message) {
    if (message.do === "hello") return this.data.hello;
    if (message.do === "window") return this.window(message);
    if (message.do === "loomis_wood") return { ...this.data.loomis_wood, total: this.data.loomis_wood.rows.length };
    if (message.do === "levels") return this.data.levels[message.species] ?? { levels: [], differences: [] };
    throw new Error("an exported page shows what was saved; `rotor view` with the session file computes");
  }
  window({ first_mhz, last_mhz, pixels }) {
    const { x, y } = this, a = Math.max(lowerBound(x, first_mhz) - 1, 0), b = Math.min(lowerBound(x, last_mhz) + 1, x.length);
    const step = Math.max(1, Math.floor((b - a) / pixels)), xs = [], ys = [];
    if (step <= 2) for (let i = a; i < b; i++) { xs.push(x[i]); ys.push(y[i]); }
    else for (let i = a; i < b; i += step) {
      let low = Infinity, high = -Infinity;
      for (let k = i; k < Math.min(i + step, b); k++) { if (y[k] < low) low = y[k]; if (y[k] > high) high = y[k]; }
      xs.push(x[i], x[i]); ys.push(low, high);
    }
    const sticks = {};
    for (const [number, all] of Object.entries(this.data.sticks)) {
      const [c, d] = [lowerBound(all.x, first_mhz), lowerBound(all.x, last_mhz)];
      sticks[number] = Object.fromEntries(Object.entries(all).map(([name, column]) => [name, column.slice(c, d)]));
    }
    return { x: xs, y: ys, sticks, model: this.data.model };
  }
}

function lowerBound(values, target) {
  let low = 0, high = values.length;
  while (low < high) { const middle = (low + high) >> 1; if (values[middle] < target) low = middle + 1; else high = middle; }
  return low;
}
function floats({ start, scale, steps, base64 }) { // numbers of an exported page: equal steps, or 32-bit numbers as text
  if (steps != null) return Float64Array.from({ length: steps }, (_, i) => start + i * scale);
  const bytes = Uint8Array.from(atob(base64), (sign) => sign.charCodeAt(0));
  return Float64Array.from(new Float32Array(bytes.buffer), (value) => start + value * scale);
}

function bokehLoaded() { // an exported page and a notebook have BokehJS before this module
  if (globalThis.Bokeh) return Promise.resolve();
  const script = document.querySelector("script[src='bokeh.js']");
  return new Promise((done, fail) => { script.onload = done; script.onerror = () => fail(new Error("BokehJS could not be loaded")); });
}

const thin = (text) => text.replace(/\d+/, (whole) => (whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, "\u2009") : whole));
function formatted(change, options = {}) { // texts at the ticks, each changed by a function of text and number
  const formatter = new Bokeh.BasicTickFormatter(options), plain = formatter.doFormat.bind(formatter);
  formatter.doFormat = (ticks, axis) => plain(ticks, axis).map((text, i) => change(text, ticks[i]));
  return formatter;
}
const spaced = () => formatted(thin, { use_scientific: false }); // frequencies: 17 990 with a thin space

// --- A figure of Bokeh with pointer handling of our own: drag, wheel, selection, nearest point

class Plot {
  constructor(app, place, { label, height, fixedY = false }) {
    this.app = app; this.place = place; this.painted = [];
    const { Range1d } = Bokeh;
    this.figure = new Bokeh.Plotting.Figure({
      tools: "", toolbar_location: null, sizing_mode: "stretch_both", min_border: 4, min_border_left: 72, min_border_right: 26, output_backend: "canvas",
      x_range: new Range1d({ start: 0, end: 1 }), y_range: new Range1d({ start: 0, end: 1 }), lod_threshold: null,
    });
    this.fixedY = fixedY;
    place.setAttribute("role", "img");
    place.setAttribute("aria-label", label);
    if (height) place.style.height = height;
  }
  source(columns) { return new Bokeh.ColumnDataSource({ data: columns }); }
  async show() {
    this.view = await Bokeh.Plotting.show(this.figure, this.place);
    this.place.addEventListener("pointerdown", (event) => this.down(event), true);
    this.place.addEventListener("pointermove", (event) => this.hover(event));
    this.place.addEventListener("pointerleave", () => this.app.tip(null));
    this.place.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    this.theme();
  }
  theme() {
    const pen = PEN[this.app.theme], f = this.figure;
    f.background_fill_color = pen.paper; f.border_fill_color = pen.paper; f.outline_line_color = pen.grid;
    for (const axis of [...f.below, ...f.left]) {
      if (!axis.axis_label_text_color && axis.axis_label_text_color !== null) continue;
      Object.assign(axis, { axis_label_text_color: pen.ink, major_label_text_color: pen.ink, axis_line_color: pen.ink,
        major_tick_line_color: pen.ink,
        minor_tick_line_color: null, axis_label_text_font_style: "normal", axis_label_text_font_size: "13px",
          major_label_text_font_size: "12px" });
    }
    for (const grid of f.center) if ("grid_line_color" in grid) grid.grid_line_color = pen.grid;
  }
  get box() { return this.view?.frame.bbox ?? { left: 0, top: 0, width: 0, height: 0 }; } // 0 until it is shown
  at(event) { // data coordinates of a pointer
    const place = this.place.getBoundingClientRect(), box = this.box;
    const [sx, sy] = [event.clientX - place.left - box.left, event.clientY - place.top - box.top];
    const { x_range: X, y_range: Y } = this.figure;
    return { x: X.start + (sx / box.width) * (X.end - X.start), y: Y.end - (sy / box.height) * (Y.end - Y.start), sx, sy,
      inside: sx >= 0 && sy >= 0 && sx <= box.width && sy <= box.height };
  }
  down(event) {
    const from = this.at(event);
    if (event.button !== 0 || !from.inside) return;
    this.onfocus?.();
    const choose = this.onselect && (this.app.choosing || event.shiftKey);
    const [start, end] = [this.figure.x_range.start, this.figure.x_range.end];
    let moved = false;
    const move = (now) => {
      const to = this.at(now);
      moved ||= Math.abs(to.sx - from.sx) > 3;
      if (!moved) return;
      if (choose) this.select(from.x, to.x, from.y);
      else this.onpan?.(start - ((to.sx - from.sx) / this.box.width) * (end - start),
        end - ((to.sx - from.sx) / this.box.width) * (end - start));
    };
    const up = (now) => {
      window.removeEventListener("pointermove", move); window.removeEventListener("pointerup", up);
      const to = this.at(now);
      if (!moved) this.onclick?.(from);
      else if (choose) this.onselect(Math.min(from.x, to.x), Math.max(from.x, to.x), from.y);
    };
    window.addEventListener("pointermove", move); window.addEventListener("pointerup", up);
  }
  select(a, b) { if (this.chosen) { this.chosen.left = Math.min(a, b); this.chosen.right = Math.max(a, b); this.chosen.visible = true; } }
  hover(event) {
    const at = this.at(event);
    this.app.tip(at.inside && this.ontip ? this.ontip(at) : null, event);
  }
  wheel(event) {
    const at = this.at(event);
    if (!at.inside || !this.onpan) return;
    event.preventDefault();
    const factor = Math.exp(clamp(event.deltaY, -200, 200) * 0.002), { start, end } = this.figure.x_range;
    this.onpan(at.x - (at.x - start) * factor, at.x + (end - at.x) * factor);
  }
}

// --- A window of the spectrum

class SpectrumWindow extends Plot {
  constructor(app, place, first, last) {
    super(app, place, { label: "Spectrum above, predicted lines as sticks" });
    this.first = first; this.last = last; this.busy = false; this.again = false; this.data = { x: [], y: [], sticks: {} };
    const f = this.figure;
    f.xaxis.axis_label = "Frequency (MHz)";
    f.xaxis.formatter = spaced();
    f.yaxis.axis_label = app.info.unit === "K" && app.info.notes.some((note) => note.includes("intensities in K assumed")) ? "Intensity" : `Intensity (${app.info.unit})`;
    f.yaxis.formatter = formatted((text, y) => (this.mirrored && y < this.foot ? "" : text)); // sticks have no unit of intensity
    this.trace = this.source({ x: [], y: [] });
    this.model = this.source({ x: [], y: [] });
    this.sticks = this.source({ x: [], y0: [], y1: [], color: [] });
    this.marks = this.source({ x: [], y: [], color: [], fill: [], marker: [] });
    this.traceGlyph = f.line({ field: "x" }, { field: "y" }, { source: this.trace, line_width: 1 });
    this.modelGlyph = f.line({ field: "x" }, { field: "y" }, { source: this.model, line_width: 1.8, line_dash: [6, 3] });
    f.segment({ field: "x" }, { field: "y0" }, { field: "x" }, { field: "y1" },
      { source: this.sticks, line_color: { field: "color" }, line_width: 1.6 });
    f.scatter({ field: "x" }, { field: "y" }, { source: this.marks, marker: { field: "marker" }, size: 9, line_color: { field: "color" },
      fill_color: { field: "fill" }, line_width: 1.5 });
    this.zero = new Bokeh.Span({ location: 0, dimension: "width", line_width: 1 });
    this.cursor = new Bokeh.Span({ location: 0, dimension: "height", line_width: 1, line_dash: [4, 4], visible: false });
    this.chosen = new Bokeh.BoxAnnotation({ left: 0, right: 0, fill_alpha: 0.15, visible: false });
    for (const mark of [this.zero, this.cursor, this.chosen]) f.add_layout(mark);
    this.onpan = (a, b) => this.go(a, b);
    this.onselect = (a, b) => app.fitPeak(a, b, this);
    this.onfocus = () => app.activate(this);
    this.onclick = (at) => { const line = this.near(at); if (line) app.offer(line, this); };
    this.ontip = (at) => this.tipAt(at);
  }
  theme() {
    super.theme();
    const pen = PEN[this.app.theme];
    this.traceGlyph.glyph.line_color = pen.trace; this.modelGlyph.glyph.line_color = pen.mark;
    this.zero.line_color = pen.grid; this.cursor.line_color = pen.mark; this.chosen.fill_color = pen.select;
      this.chosen.line_color = pen.select;
    this.draw();
  }
  go(first, last) {
    const [low, high] = this.app.info.band_mhz, least = Math.max(4 * this.app.info.channel_mhz, 1e-6), most = (high - low) * 1.1;
    const span = clamp(last - first, least, most), middle = clamp((first + last) / 2, low, high);
    this.first = middle - span / 2; this.last = middle + span / 2;
    this.figure.x_range.setv({ start: this.first, end: this.last });
    this.loading = this.load();
    this.app.placed(this);
  }
  async load() { // one request at a time; the last wish counts
    if (this.busy) { this.again = true; return; }
    this.busy = true;
    const margin = (this.last - this.first) / 3, begun = performance.now();
    try {
      this.data = await this.app.transport.call({ do: "window", first_mhz: this.first - margin, last_mhz: this.last + margin,
        pixels: Math.round((this.box.width || 800) * 5 / 3), preview: this.app.preview ?? undefined });
      this.draw();
    } catch (error) { this.app.say(error.message, true); }
    this.busy = false;
    this.app.answered = performance.now() - begun;
    if (this.again) { this.again = false; this.load(); }
  }
  draw() {
    const { x, y, sticks, model } = this.data, app = this.app, colors = PALETTE[app.theme];
    let low = Infinity, high = -Infinity;
    for (let i = 0; i < x.length; i++) if (x[i] >= this.first && x[i] <= this.last) { if (y[i] < low) low = y[i];
      if (y[i] > high) high = y[i]; }
    if (model && app.settings.emission) for (let i = 0; i < model.x.length;
      i++) if (model.x[i] >= this.first && model.x[i] <= this.last) high = Math.max(high, model.y[i]);
    if (!isFinite(low)) { low = 0; high = 1; }
    const tall = Math.max(high - Math.min(low, 0), 1e-30), mirrored = this.mirrored = !app.settings.overlaid && Object.keys(sticks).length > 0;
    let strongest = 0;
    for (const predicted of Object.values(sticks)) predicted.x.forEach((at,
      i) => { if (at >= this.first && at <= this.last && predicted.height[i] > strongest) strongest = predicted.height[i]; });
    const unit = (tall * 0.95) / (app.autoscale ? strongest || 1 : 1);
    const columns = { x: [], y0: [], y1: [], color: [] };
    const least = Object.values(sticks).reduce((sum, predicted) => sum + predicted.x.length, 0) < 200 ? 0.012 * tall : 0;
      // a weak line is seen where there are few
    this.lines = [];
    const foot = mirrored ? Math.min(low, 0) - 0.04 * tall : 0;
    this.foot = foot;
    for (const [number, predicted] of Object.entries(sticks)) {
      const color = colors[(app.species[number]?.colour ?? 0) % colors.length];
      predicted.x.forEach((at, i) => {
        columns.x.push(at); columns.y0.push(foot); columns.color.push(color);
        columns.y1.push(mirrored ? foot - Math.max(predicted.height[i] * unit, least) : foot + predicted.height[i] * unit);
        this.lines.push({ species: Number(number), upper: predicted.upper[i], lower: predicted.lower[i], frequency_mhz: at, height: predicted.height[i] });
      });
    }
    this.sticks.data = columns;
    this.trace.data = { x, y };
    this.model.data = model && app.settings.emission ? { x: model.x, y: model.y } : { x: [], y: [] };
    const top = high + 0.09 * tall, marks = { x: [], y: [], color: [], fill: [], marker: [] };
    for (const [number, line] of Object.entries(app.lines)) {
      const color = colors[(app.species[line.species]?.colour ?? 0) % colors.length];
      marks.x.push(line.frequency_mhz); marks.y.push(high + 0.05 * tall); marks.color.push(color);
      marks.fill.push(line.rejected ? PEN[app.theme].paper : Number(number) === app.line ? PEN[app.theme].mark : color);
      marks.marker.push(line.rejected ? "x" : "inverted_triangle");
    }
    this.marks.data = marks;
    this.zero.location = foot;
    const bottom = mirrored ? foot - tall * 1.02 : Math.min(low, 0) - 0.05 * tall;
    this.figure.y_range.setv({ start: bottom, end: top + 0.03 * tall });
  }
  near(at, reach = 7) { // the predicted line nearest to a pointer, within so many pixels
    const scale = this.box.width / (this.last - this.first);
    let best = null, least = reach;
    for (const line of this.lines ?? []) {
      const away = Math.abs(line.frequency_mhz - at.x) * scale;
      if (away < least || (away === least && best && line.height > best.height)) { best = line; least = away; }
    }
    return best;
  }
  tipAt(at) {
    const line = this.near(at), digits = clamp(Math.ceil(-Math.log10((this.last - this.first) / this.box.width)), 0, 6);
    const here = `${at.x.toFixed(digits)} MHz`;
    if (!line) return here;
    return `${this.app.species[line.species]?.name ?? ""}  ${this.app.text(line)}\n${line.frequency_mhz.toFixed(4)} MHz, ${percent(line.height)} % of the strongest`;
  }
}

// --- Residuals against frequency, linked to the spectrum

class ResidualPlot extends Plot {
  constructor(app, place) {
    super(app, place, { label: "Observed minus calculated frequency of the assigned lines" });
    const f = this.figure;
    f.xaxis.axis_label = "Frequency (MHz)"; f.yaxis.axis_label = "Obs − calc (kHz)";
    f.xaxis.formatter = spaced();
    this.bars = this.source({ x: [], y0: [], y1: [], color: [] });
    this.points = this.source({ x: [], y: [], color: [], fill: [], marker: [] });
    this.zero = new Bokeh.Span({ location: 0, dimension: "width", line_width: 1 });
    this.shown = new Bokeh.BoxAnnotation({ left: 0, right: 0, fill_alpha: 0.12, line_alpha: 0.6 });
    f.add_layout(this.zero); f.add_layout(this.shown);
    f.segment({ field: "x" }, { field: "y0" }, { field: "x" }, { field: "y1" },
      { source: this.bars, line_color: { field: "color" }, line_alpha: 0.6 });
    f.scatter({ field: "x" }, { field: "y" }, { source: this.points, marker: { field: "marker" }, size: 8, line_color: { field: "color" },
      fill_color: { field: "fill" } });
    this.onclick = (at) => { const point = this.nearest(at); if (point) app.selectLine(point.number, true); };
    this.ontip = (at) => { const point = this.nearest(at);
      return point ? `${app.name(point.line)}  ${point.facts.label}\nobs − calc ${fixed(1e3 * point.facts.difference_mhz, 2)} kHz` : null; };
  }
  theme() { super.theme(); const pen = PEN[this.app.theme]; this.zero.line_color = pen.ink; this.shown.fill_color = pen.select;
    this.shown.line_color = pen.select; this.draw(); }
  draw() {
    const app = this.app, colors = PALETTE[app.theme], bars = { x: [], y0: [], y1: [], color: [] },
      points = { x: [], y: [], color: [], fill: [], marker: [] };
    this.rows = [];
    let most = 0;
    for (const [number, line] of Object.entries(app.lines)) {
      const facts = app.facts[number];
      if (facts?.difference_mhz == null) continue;
      const y = 1e3 * facts.difference_mhz, error = 1e3 * line.error_mhz, colour = app.species[line.species]?.colour ?? 0,
        color = colors[colour % colors.length];
      this.rows.push({ number: Number(number), line, facts, x: line.frequency_mhz, y });
      bars.x.push(line.frequency_mhz); bars.y0.push(y - error); bars.y1.push(y + error); bars.color.push(color);
      points.x.push(line.frequency_mhz); points.y.push(y); points.color.push(color);
        points.marker.push(line.rejected ? "x" : MARKS[colour % MARKS.length]);
      points.fill.push(Number(number) === app.line ? PEN[app.theme].mark : color);
      if (!line.rejected) most = Math.max(most, Math.abs(y) + error);
    }
    this.bars.data = bars; this.points.data = points;
    const [low, high] = app.info.band_mhz;
    this.figure.x_range.setv({ start: low, end: high });
    this.figure.y_range.setv({ start: -1.15 * (most || 1), end: 1.15 * (most || 1) });
    this.link();
  }
  link() { const w = this.app.active; if (w) { this.shown.left = w.first; this.shown.right = w.last; } }
  nearest(at) {
    const { x_range: X, y_range: Y } = this.figure, sx = this.box.width / (X.end - X.start), sy = this.box.height / (Y.end - Y.start);
    let best = null, least = 12;
    for (const row of this.rows ?? []) { const away = Math.hypot((row.x - at.x) * sx, (row.y - at.y) * sy);
      if (away < least) { best = row; least = away; } }
    return best;
  }
}

// --- Loomis-Wood rows

class LoomisWood extends Plot {
  constructor(app, place) {
    super(app, place, { label: "Loomis-Wood rows of a series" });
    const f = this.figure;
    this.half = app.transport.data?.loomis_wood.half_width_mhz ?? Math.max(2, 20 * app.info.channel_mhz); this.scale = 1; this.rows = [];
      this.busy = false; this.first = 0; this.row = null; this.total = 0; this.count = ROWS;
    f.xaxis.axis_label = "Distance from the expected line (MHz)";
    f.yaxis.visible = false; f.ygrid.visible = false;
    this.traces = this.source({ xs: [], ys: [] });
    this.texts = this.source({ x: [], y: [], text: [] });
    this.marks = this.source({ x: [], y: [], color: [], marker: [] });
    this.traceGlyph = f.multi_line({ field: "xs" }, { field: "ys" }, { source: this.traces, line_width: 1 });
    this.textGlyph = f.text({ field: "x" }, { field: "y" }, { field: "text" },
      { source: this.texts, text_font_size: "11px", text_baseline: "bottom" });
    f.scatter({ field: "x" }, { field: "y" }, { source: this.marks, marker: { field: "marker" }, size: 9, line_color: { field: "color" },
      fill_color: { field: "color" } });
    this.middle = new Bokeh.Span({ location: 0, dimension: "height", line_width: 1, line_dash: [4, 4] });
    this.band = new Bokeh.BoxAnnotation({ bottom: 0, top: 0, fill_alpha: 0.12, visible: false });
    f.add_layout(this.band);
    this.chosen = new Bokeh.BoxAnnotation({ left: 0, right: 0, fill_alpha: 0.2, visible: false });
    f.add_layout(this.middle); f.add_layout(this.chosen);
    this.onselect = (a, b, y) => { this.chosen.visible = false; const row = this.rowAt(y);
      if (row) app.fitPeak(row.centre_mhz + a, row.centre_mhz + b, app.active, row); };
    this.onpan = null;
    this.onclick = (at) => { const row = this.rowAt(at.y); if (row) app.show(row.centre_mhz + at.x, app.active); };
    this.ontip = (at) => { const row = this.rowAt(at.y);
      return row ? `row ${row.n}${row.upper.length ? "  " + app.text({ ...row, species: app.settings.series?.species }) : ""}\n${(row.centre_mhz + at.x).toFixed(4)} MHz` : null; };
  }
  theme() {
    super.theme();
    const pen = PEN[this.app.theme];
    this.traceGlyph.glyph.line_color = pen.trace; this.textGlyph.glyph.text_color = pen.ink; this.middle.line_color = pen.mark;
    this.chosen.fill_color = pen.select; this.band.fill_color = pen.select; this.band.line_color = pen.select;
    this.draw();
  }
  async turn(by, row = null) { // other rows where there are more than are drawn
    const first = clamp(this.first + by, 0, Math.max(this.total - this.count, 0));
    if (first === this.first) return;
    this.first = first; this.row = row;
    await this.load();
  }
  async next(by) { // the next row: marked, its line shown in the spectrum
    let row = this.row == null ? (by > 0 ? 0 : this.rows.length - 1) : this.row + by;
    if (row >= this.rows.length && this.first + this.rows.length < this.total) { await this.turn(this.count); row = this.row ?? 0; }
    else if (row < 0 && this.first > 0) { await this.turn(-this.count); row = this.rows.length - 1; }
    if (!this.rows[row]) return;
    this.row = row; this.draw();
    this.app.show(this.rows[row].centre_mhz, this.app.active);
    this.app.say(`Row ${this.rows[row].n}: f fits its peak`);
  }
  rowAt(y) { return this.rows[Math.round(-y - 0.3)] ?? null; }
  async load() {
    if (this.busy) { this.again = true; return; }
    this.busy = true;
    try {
      const answer = await this.app.transport.call({ do: "loomis_wood", half_width_mhz: this.half,
        pixels: Math.round((this.box.width || 500) * 0.8), rows: this.count, first_row: this.first, preview: this.app.preview ?? undefined });
      this.rows = answer.rows; this.total = answer.total ?? answer.rows.length;
      if (!this.rows.length && this.first) { this.first = 0; this.again = true; }
      if (this.row >= this.rows.length) this.row = null;
      this.app.woodPage();
      this.draw();
    } catch (error) { this.app.say(error.message, true); }
    this.busy = false;
    if (this.again) { this.again = false; this.load(); }
  }
  draw() {
    const app = this.app, xs = [], ys = [], texts = { x: [], y: [], text: [] }, marks = { x: [], y: [], color: [], marker: [] };
    const colors = PALETTE[app.theme], series = app.settings.series;
    const stride = Math.ceil((12 * this.rows.length) / (this.box.height || 300)); // so that labels do not overlap
    this.rows.forEach((row, i) => {
      let low = Infinity, high = -Infinity;
      for (const value of row.y) { if (value < low) low = value; if (value > high) high = value; }
      const unit = (0.85 * this.scale) / (high - low || 1);
      xs.push(row.x); ys.push(row.y.map((value) => Math.min((value - low) * unit, 1.4) - i - 0.7));
      if (i % stride === 0) texts.x.push(-0.99 * this.half), texts.y.push(-i - 0.56), texts.text.push(row.upper.length ? app.text({ ...row, species: series?.species }) : `${row.n}:  ${row.centre_mhz.toFixed(3)}`);
      if (row.at != null && Math.abs(row.at) < this.half) { marks.x.push(row.at); marks.y.push(-i - 0.8);
        marks.color.push(colors[(app.species[series?.species]?.colour ?? 0) % colors.length]);
        marks.marker.push(row.rejected ? "x" : "triangle"); }
    });
    this.traces.data = { xs, ys }; this.texts.data = texts; this.marks.data = marks;
    this.band.visible = this.row != null; this.band.top = 0.25 - (this.row ?? 0); this.band.bottom = -0.75 - (this.row ?? 0);
    this.figure.x_range.setv({ start: -this.half, end: this.half });
    this.figure.y_range.setv({ start: -Math.max(this.rows.length, 3) - 0.1, end: 0.6 });
  }
}

// --- The page

export class App {
  constructor(root, transport) {
    this.root = root; this.transport = transport; this.windows = [];
      this.theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
    this.choosing = false; this.autoscale = true; this.tab = "Assign"; this.pane = "residuals"; this.line = null; this.offered = null;
      this.measured = [];
    this.filter = ""; this.picked = new Set(); this.spans = {}; this.preview = null;
    transport.onsession = (session) => this.update(session);
    transport.onstatus = (text) => this.lostText(text);
    transport.onnotes = (notes) => notes.forEach((note) => this.say(note));
  }
  async start() { // the spectrum first; the server answers while the browser loads BokehJS
    const answer = this.transport.open().then(() => this.transport.call({ do: "hello" }));
    [this.info] = await Promise.all([answer, bokehLoaded()]);
    this.take(this.info.session);
    this.build();
    const [low, high] = this.info.band_mhz, spectrum = await this.addWindow(low, high);
    await spectrum.loading;
    await frame();
    this.root.dataset.drawn = "yes";
    this.residuals = new ResidualPlot(this, this.residualPlace);
    this.wood = new LoomisWood(this, this.woodPlace);
    await Promise.all([this.residuals.show(), this.wood.show()]);
    this.panels();
    for (const note of this.session.warnings) this.say(note, true);
    this.root.dataset.ready = "yes";
  }
  take(session) {
    this.session = session; this.species = {}; this.lines = {};
      this.settings = { series: null, emission: false, overlaid: false, auto_refit: false, least_error_mhz: 0.001 };
    for (const [key, record] of Object.entries(session.records)) {
      const [kind, number] = key.split("/");
      if (kind === "species") this.species[number] = record;
      else if (kind === "line") this.lines[number] = record;
      else this.settings = record;
    }
    this.facts = session.lines; this.quanta = session.quanta;
    if (this.line != null && !this.lines[this.line]) this.line = null;
    this.picked = new Set([...this.picked].filter((number) => this.lines[number]));
  }
  update(session) {
    if (!this.windows.length || (this.session && session.revision < this.session.revision)) return;
    this.take(session); this.preview = null;
    this.refresh();
  }
  refresh() {
    for (const w of this.windows) w.load();
    this.residuals?.draw();
    if (this.pane === "wood") this.wood?.load();
    this.panels(); this.bar();
  }
  async do(message, done) { // an action: what it says stands in the status line
    try {
      const answer = await this.transport.call(message);
      if (answer.label) this.say(done ?? answer.label);
      return answer;
    } catch (error) { this.say(error.message, true); return null; }
  }
  say(text, wrong = false) {
    this.status.textContent = text;
    this.status.classList.toggle("wrong", wrong);
  }
  lostText(text) { if (this.banner) { this.banner.textContent = text; this.banner.hidden = !text; } }
  name(line) { return this.species[line.species]?.name ?? "?"; }
  known(species) { return this.quanta[species] ?? { names: [], halves: [] }; }
  label(q, species) { const { names, halves } = this.known(species); return q.map((value, i) => quantum(value, names[i], halves)).join(" "); }
  text(line) { return `${this.label(line.upper, line.species)} ← ${this.label(line.lower, line.species)}`; }

  // Building

  build() {
    const button = (text, title, action, extra = {}) => h("button", { type: "button", title, onclick: action, ...extra }, text);
    const live = this.transport.live;
    this.status = h("output", { class: "status", role: "status", "aria-live": "polite" });
    this.banner = h("div", { class: "banner", role: "alert", hidden: true });
    this.undoButton = button("Undo", "u", () => this.do({ do: "undo" }));
    this.redoButton = button("Redo", "y", () => this.do({ do: "redo" }));
    this.chooseButton = button("Select", "a: drag over a peak to fit it", () => this.choose(!this.choosing), { "aria-pressed": "false" });
    this.autoBox = h("input", { type: "checkbox", onchange: (event) => this.do({ do: "settings", auto_refit: event.target.checked }) });
    this.exportMenu = h("select", { "aria-label": "Export", onchange: (event) => { const what = event.target.value;
      event.target.value = ""; this.export(what); } },
      h("option", { value: "" }, "Export…"), live ? EXPORTS.map(([what, text]) => h("option", { value: what }, text)) : [],
        h("option", { value: "png" }, "Picture (.png)"));
    const bar = h("header", { class: "bar" },
      h("strong", { class: "name", title: this.session.spectrum.path }, this.session.spectrum.path.split("/").pop()),
      h("span", { class: "group" }, button("−", "zoom out", () => this.zoom(2), { "aria-label": "Zoom out" }),
        button("+", "zoom in", () => this.zoom(0.5), { "aria-label": "Zoom in" }),
        button("All", "0: the whole band", () => this.active.go(...this.info.band_mhz))),
      live && h("span", { class: "group" }, this.chooseButton, this.undoButton, this.redoButton),
      live && h("span", { class: "group" }, button("Refit", "r: fit the free constants to the assigned lines", () => this.refit(),
        { class: "main" }), h("label", { title: "refit after each assignment" }, this.autoBox, "auto")),
      h("span", { class: "group" }, this.exportMenu, button("Windows", "w: a second window", () => this.twoWindows()),
        button("Keys", "?", () => this.help()), button("◐", "t: light or dark", () => this.turn(), { "aria-label": "Light or dark" })));
    this.windowPlaces = h("div", { class: "windows" });
    this.residualPlace = h("div", { class: "plot" }); this.woodPlace = h("div", { class: "plot", style: "visibility:hidden" });
    this.residualTab = button("Residuals", "l", () => this.showPane("residuals"), { role: "tab" });
    this.woodTab = button("Loomis-Wood", "l", () => this.showPane("wood"), { role: "tab" });
    this.woodTools = h("span", { class: "group", hidden: true },
      h("label", {}, "± MHz ", h("input", { type: "number", min: "0.001", step: "any", style: "width:6em", "data-field": "half",
        onchange: (event) => { this.wood.half = Math.abs(Number(event.target.value)) || 1; this.wood.load(); } })),
      h("label", {}, "rows ", h("input", { type: "number", min: "1", max: "200", value: `${ROWS}`, style: "width:4.5em", "data-field": "rows",
        onchange: (event) => { this.wood.count = clamp(Math.round(Number(event.target.value)) || ROWS, 1, 200); this.wood.load(); } })),
      h("label", {}, "height ", h("input", { type: "range", min: "-1", max: "2", step: "0.1", value: "0",
        oninput: (event) => { this.wood.scale = 10 ** Number(event.target.value); this.wood.draw(); } })),
      live && button("Assign all rows", "a peak within a fifth of the half width of each expected line",
        () => this.do({ do: "assign_series", tolerance_mhz: this.wood.half / 5 })),
      this.woodPages = h("span", { class: "group", hidden: true }, button("▲", "earlier rows", () => this.wood.turn(-this.wood.count), { "aria-label": "Earlier rows" }),
        h("output", {}), button("▼", "later rows", () => this.wood.turn(this.wood.count), { "aria-label": "Later rows" })));
    this.tabButtons = TABS.map((name, i) => button(name, `${i + 1}`, () => this.showTab(name),
      { role: "tab", id: `tab-${name}`, "aria-controls": "panel" }));
    this.panel = h("div", { class: "panel", id: "panel", role: "tabpanel", tabindex: "0" });
    this.tipBox = h("div", { class: "tip", hidden: true });
    this.helpBox = h("dialog", { class: "keys", "aria-label": "Keys" }, h("h2", {}, "Keys"),
      h("dl", {}, KEYS.map(([key, text]) => [h("dt", {}, key), h("dd", {}, text)])),
      h("p", {}, "Drag moves the spectrum, the wheel zooms. Shift and drag over a peak fits it; several lines marked in the list make a blend. A click on a stick offers that line."),
      h("form", { method: "dialog" }, h("button", {}, "Close")));
    this.root.replaceChildren(bar, this.banner,
      h("main", { class: "body" },
        h("section", { class: "plots" }, this.windowPlaces,
          h("div", { class: "lower" }, h("div", { class: "tabs" },
            h("span", { role: "tablist", class: "group" }, this.residualTab, this.woodTab), this.woodTools),
            h("div", { class: "stack" }, this.residualPlace, this.woodPlace))),
        h("aside", { class: "side" }, h("div", { class: "tabs", role: "tablist" }, this.tabButtons), this.panel)),
      h("footer", {}, this.status, h("output", { class: "place" })), this.tipBox, this.helpBox);
    this.root.classList.add("rotor-view");
    this.root.dataset.theme = this.theme;
    this.root.tabIndex = -1;
    const target = this.root === document.body ? document : this.root;
    target.addEventListener("keydown", (event) => this.key(event));
    this.showPane(this.pane, false);
    this.bar();
  }
  async addWindow(first, last) {
    const place = h("div", { class: "plot window", tabindex: "0", onfocus: () => this.activate(made) });
    this.windowPlaces.append(place);
    const made = new SpectrumWindow(this, place, first, last);
    this.windows.push(made);
    await made.show();
    this.activate(made);
    made.go(first, last);
    return made;
  }
  async twoWindows() {
    if (this.windows.length > 1) { const gone = this.windows.pop(); gone.place.remove(); this.activate(this.windows[0]); return; }
    const { first, last } = this.active;
    await this.addWindow(first, last);
  }
  activate(spectrum) {
    this.active = spectrum;
    for (const other of this.windows) other.place.classList.toggle("active", other === spectrum && this.windows.length > 1);
    this.placed(spectrum);
  }
  placed(spectrum) {
    if (spectrum !== this.active) return;
    this.residuals?.link();
    const out = this.root.querySelector(".place");
    if (out) out.textContent = `${spectrum.first.toFixed(3)} to ${spectrum.last.toFixed(3)} MHz`;
  }
  bar() {
    const { undo, redo } = this.session;
    this.undoButton.disabled = !undo; this.redoButton.disabled = !redo;
    this.undoButton.title = undo ? `u: undo “${undo}”` : "nothing to undo";
      this.redoButton.title = redo ? `y: redo “${redo}”` : "nothing to redo";
    this.autoBox.checked = this.settings.auto_refit;
  }
  turn() {
    this.theme = this.theme === "dark" ? "light" : "dark";
    this.root.dataset.theme = this.theme;
    for (const plot of [...this.windows, this.residuals, this.wood]) plot.theme();
    this.panels();
  }
  tip(text, event) {
    this.tipBox.hidden = !text;
    if (!text) return;
    this.tipBox.textContent = text;
    const { clientX: x, clientY: y } = event, wide = this.tipBox.offsetWidth, host = this.root.getBoundingClientRect();
    const origin = this.root === document.body ? { left: 0, top: 0 } : host;
    this.tipBox.style.left = `${clamp(x + 14, 4, window.innerWidth - wide - 4) - origin.left}px`;
    this.tipBox.style.top = `${y + 16 - origin.top}px`;
  }
  help() { this.helpBox.open ? this.helpBox.close() : this.helpBox.showModal(); }
  choose(on) { this.choosing = on; this.chooseButton.setAttribute("aria-pressed", String(on)); this.root.classList.toggle("choosing", on);
    this.say(on ? "Drag over a peak to fit it" : "Drag moves the spectrum"); }
  zoom(factor) { const w = this.active, middle = (w.first + w.last) / 2, half = ((w.last - w.first) / 2) * factor;
    w.go(middle - half, middle + half); }
  show(frequency, spectrum, span = null) {
    const w = spectrum ?? this.active, wide = span ?? Math.min(w.last - w.first, Math.max(60 * this.info.channel_mhz, frequency * 2e-4));
    w.cursor.location = frequency; w.cursor.visible = true;
    w.go(frequency - wide / 2, frequency + wide / 2);
  }
  showTab(name) { this.tab = name; this.panels();
    if (window.innerWidth <= 900) this.panel.parentElement.scrollIntoView({ block: "nearest" }); if (name === "Levels") this.loadLevels(); }
  showPane(name, load = true) {
    this.pane = name;
    const wood = name === "wood";
    this.woodPlace.style.visibility = wood ? "visible" : "hidden";
    this.woodTools.hidden = !wood;
    this.residualPlace.style.visibility = wood ? "hidden" : "visible";
    this.residualTab.setAttribute("aria-selected", String(!wood)); this.woodTab.setAttribute("aria-selected", String(wood));
    this.root.classList.toggle("wood", wood);
    if (load && wood) { this.woodTools.querySelector("[data-field=half]").value = this.wood.half; this.wood.load(); }
  }

  woodPage() { // which of many rows are drawn
    const { first, rows, total } = this.wood;
    this.woodPages.hidden = total <= this.wood.count;
    this.woodPages.querySelector("output").textContent = `${first + 1}–${first + rows.length} of ${total}`;
  }

  // Assigning

  async fitPeak(first, last, spectrum, row = null) {
    this.active = spectrum; spectrum.chosen.left = first; spectrum.chosen.right = last; spectrum.chosen.visible = true;
    let answer;
    try { answer = await this.transport.call({ do: "peak", first_mhz: first, last_mhz: last, reach_mhz: (spectrum.last - spectrum.first) / 8 }); }
    catch (error) { this.say(error.message, true); return null; }
    const middle = answer.peak?.frequency_mhz ?? (first + last) / 2;
    if (answer.peak) { spectrum.cursor.location = middle; spectrum.cursor.visible = true; this.measured = [...this.measured, middle].slice(-3); }
    const series = this.settings.series;
    const inside = (c) => c.frequency_mhz >= first && c.frequency_mhz <= last;
    if (row?.upper.length && !answer.candidates.some((c) => this.same(c,
      { ...row, species: series.species }))) answer.candidates.unshift({ species: series.species, upper: row.upper, lower: row.lower,
      frequency_mhz: row.centre_mhz, off_mhz: row.centre_mhz - middle, height: 0, assigned: row.line != null });
    let marked = answer.candidates.findIndex((c) => (row?.upper.length ? this.same(c,
      { ...row, species: series.species }) : this.wish ? this.same(c, this.wish) : inside(c)));
    if (marked < 0 && answer.candidates.length && !row) marked = answer.candidates.reduce((best, c, i,
      all) => (Math.abs(c.off_mhz) < Math.abs(all[best].off_mhz) ? i : best), 0);
    this.wish = null;
    this.offered = { ...answer, first, last, marked: new Set(marked >= 0 ? [marked] : []) };
    this.say(answer.peak ? `Peak at ${middle.toFixed(4)} MHz; Enter assigns it to the marked line` : answer.why, !answer.peak);
    this.tab = "Assign"; this.panels();
    return this.offered;
  }
  same(a, b) { return a.species === b.species && String(a.upper) === String(b.upper) && String(a.lower) === String(b.lower); }
  offer(line, spectrum) { // a predicted line: the peak about it is fitted, and the line marked
    this.wish = line;
    const reach = Math.max(8 * this.info.channel_mhz, (spectrum.last - spectrum.first) / 40);
    return this.fitPeak(line.frequency_mhz - reach, line.frequency_mhz + reach, spectrum);
  }
  fitMiddle() {
    const w = this.active, { row: at, rows, half } = this.wood, row = this.pane === "wood" && at != null ? rows[at] : null;
    if (row && w.cursor.visible && w.cursor.location === row.centre_mhz) return this.fitPeak(row.centre_mhz - half / 5, row.centre_mhz + half / 5, w, row);
    const middle = w.cursor.visible ? w.cursor.location : (w.first + w.last) / 2, reach = Math.max(8 * this.info.channel_mhz, (w.last - w.first) / 40);
    return this.fitPeak(middle - reach, middle + reach, w);
  }
  async assign() {
    const { peak, candidates, marked } = this.offered ?? {};
    const chosen = [...(marked ?? [])].map((i) => candidates[i]);
    if (!peak || !chosen.length) { this.say("Select a peak (Shift and drag, or f), then mark the lines that it is", true); return; }
    const total = chosen.reduce((sum, c) => sum + c.height, 0);
    const to = chosen.map((c) => ({ species: c.species, upper: c.upper, lower: c.lower,
      weight: chosen.length > 1 && total > 0 ? Math.max(c.height / total, 1e-6) : 1 }));
    const answer = await this.do({ do: "assign", frequency_mhz: peak.frequency_mhz, error_mhz: peak.error_mhz, width_mhz: peak.width_mhz,
      to });
    if (answer) { this.offered = null; for (const w of this.windows) w.chosen.visible = false; this.panels(); }
  }
  selectLine(number, go = false) {
    this.line = Number(number);
    this.picked = new Set([String(number)]);
    if (go) { this.show(this.lines[number].frequency_mhz, this.active); this.tab = "Lines"; }
    for (const w of this.windows) w.draw();
    this.residuals.draw(); this.panels();
  }
  step(direction, list) { // the next of some frequencies from the middle of the window
    const w = this.active,
      middle = w.cursor.visible && w.cursor.location > w.first && w.cursor.location < w.last ? w.cursor.location : (w.first + w.last) / 2,
      tiny = 1e-6;
    const ahead = list.filter((candidate) => direction * (candidate.frequency_mhz - middle) > tiny);
    if (!ahead.length) { this.say("No line further on in this window", true); return null; }
    const next = ahead.reduce((best, candidate) => (direction * (candidate.frequency_mhz - best.frequency_mhz) < 0 ? candidate : best));
    this.show(next.frequency_mhz, w, w.last - w.first);
    return next;
  }
  stepPredicted(direction) {
    const w = this.active, tallest = Math.max(...(w.lines ?? []).map((line) => line.height), 0);
    const line = this.step(direction, (w.lines ?? []).filter((candidate) => candidate.height > 0.01 * tallest));
    if (line) { this.wish = line;
      this.say(`${this.name(line)} ${this.text(line)}, ${line.frequency_mhz.toFixed(4)} MHz; f fits the peak there`); }
  }
  stepAssigned(direction) {
    const rows = Object.entries(this.lines).sort((a, b) => a[1].frequency_mhz - b[1].frequency_mhz).map(([number]) => Number(number));
    if (!rows.length) { this.say("No line is assigned", true); return; }
    const middle = (this.active.first + this.active.last) / 2, away = (number) => Math.abs(this.lines[number].frequency_mhz - middle);
    const nearest = rows.reduce((best, number) => (away(number) < away(best) ? number : best));
    this.selectLine(this.line == null ? nearest : rows[clamp(rows.indexOf(this.line) + direction, 0, rows.length - 1)], true);
  }
  numbers() { return [...this.picked].map(Number); }
  reject() { const lines = this.numbers(); if (lines.length) this.do({ do: "reject", lines, rejected: !this.lines[lines[0]].rejected });
    else this.say("Select a line first", true); }
  remove() { const lines = this.numbers(); if (lines.length) this.do({ do: "remove", lines }); else this.say("Select a line first", true); }
  async refit() { // every species that has lines, as one step
    const answer = await this.do({ do: "refit" });
    if (!answer) return;
    await frame();
    const fitted = Object.values(this.species).filter((species) => species.fit);
    this.say(fitted.map(({ name, fit }) => `${name}: ${fit.lines} lines, rms ${fixed(1e3 * fit.rms_mhz, 2)} kHz, weighted ${fixed(fit.weighted_rms, 2)}`).join("; "));
    const wrong = fitted.find((species) => species.fit.suspect?.length);
    if (wrong) { this.selectLine(wrong.fit.suspect[0], true); this.say(this.suspicion(wrong.fit), true); }
  }
  suspicion({ suspect, weighted_rms: poor, rms_without: good }) { // the line that a poor fit is better off without
    const there = suspect.filter((number) => this.lines[number] && !this.lines[number].rejected);
    return there.length ? `${there.map((number) => this.text(this.lines[number])).join(", ")} at ${this.lines[there[0]].frequency_mhz.toFixed(4)} MHz does not fit: without it the weighted rms is ${short(good)}, not ${short(poor)}. Reject it (x) or assign it anew.` : "";
  }
  async export(what) {
    if (!what) return;
    if (what === "png") return this.picture();
    for (const number of Object.keys(this.species)) {
      if (what !== "toml" && !Object.values(this.lines).some((line) => line.species === Number(number))) continue;
      try { const { name, text } = await this.transport.call({ do: "export", what, species: Number(number) });
        this.download(name, new Blob([text], { type: "text/plain" })); this.say(`${name} written`); }
      catch (error) { this.say(error.message, true); }
    }
  }
  picture() {
    const canvases = [this.active, this.pane === "wood" ? this.wood : this.residuals].map((plot) => plot.view.export().canvas);
    const out = h("canvas", { width: Math.max(...canvases.map((c) => c.width)), height: canvases.reduce((sum, c) => sum + c.height, 0) });
    let top = 0;
    for (const canvas of canvases) { out.getContext("2d").drawImage(canvas, 0, top); top += canvas.height; }
    out.toBlob((blob) => this.download("view.png", blob));
  }
  download(name, blob) { const link = h("a", { href: URL.createObjectURL(blob), download: name }); link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 5000); }

  // Panels

  panels() {
    TABS.forEach((name, i) => this.tabButtons[i].setAttribute("aria-selected", String(name === this.tab)));
    const active = document.activeElement, field = active?.closest?.("[data-field]")?.dataset.field, top = this.panel.scrollTop;
    const keyboard = active?.matches?.(":focus-visible"), place = [...this.panel.querySelectorAll("button, input, select, summary")].indexOf(active);
    if (this.sliding) return; // a slider that is being dragged stays
    this.panel.replaceChildren(...[this[`panel${this.tab}`]()].flat(3).filter((part) => part != null && part !== false));
    this.panel.scrollTop = top;
    const again = field ? this.panel.querySelector(`[data-field="${CSS.escape(field)}"]`)
      : this.panel.querySelectorAll("button, input, select, summary")[place];
    if (field || (keyboard && place >= 0)) (again?.textContent === active.textContent ? again : this.panel).focus(); // the keyboard stays where it was
  }
  swatch(number) { return h("span",
    { class: "swatch", style: `background:${PALETTE[this.theme][(this.species[number]?.colour ?? 0) % 7]}` }); }
  panelAssign() {
    const o = this.offered, live = this.transport.live;
    if (!Object.keys(this.species).length) return [h("p", {},
      "No molecule yet. Add one by name, file or SMILES, or let rotor assign look for unknown ones."), live && this.adder(),
      live && this.searcher()].filter(Boolean);
    if (!o) return [h("h3", {}, "Assign a peak"), h("ol", {}, h("li", {},
      "Shift and drag over a peak, or click a predicted stick (keys: n, then f)."),
      h("li", {}, "Mark the lines that it is; several make a blend."), h("li", {}, "Enter.")),
      this.fitSummary()];
    const head = o.peak ? h("dl", { class: "facts" }, [["centre",
      `${o.peak.frequency_mhz.toFixed(4)} ± ${fixed(o.peak.error_mhz, 5)} MHz`],
      ["width", o.peak.width_mhz == null ? "not in the list" : `${fixed(o.peak.width_mhz, 4)} ± ${fixed(o.peak.width_error_mhz, 4)} MHz`],
      ["height", `${o.peak.height.toPrecision(4)}${o.peak.height_error == null ? "" : ` ± ${o.peak.height_error.toPrecision(2)}`}`]].map(([a, b]) => [h("dt", {}, a), h("dd", {}, b)])) : h("p", { class: "wrong" }, o.why);
    const rows = o.candidates.slice(0, 60).map((c, i) => h("tr", { class: o.marked.has(i) ? "marked" : "" },
      h("td", {}, h("input", { type: "checkbox", "data-field": `c${i}`, "aria-label": this.text(c), checked: o.marked.has(i),
        onchange: (event) => { event.target.checked ? o.marked.add(i) : o.marked.delete(i); this.panels(); } })),
      h("td", {}, this.swatch(c.species), this.text(c), c.assigned ? " ✓" : ""), h("td", { class: "number" }, fixed(c.off_mhz, 3)),
        h("td", { class: "number" }, percent(c.height))));
    return [h("h3", {}, "Peak"), head, h("h3", {}, "It may be"),
      o.candidates.length ? h("table", {}, h("thead", {}, h("tr", {}, h("th", {}, ""), h("th", {}, "line"),
        h("th", { class: "number" }, "off (MHz)"), h("th", { class: "number" }, "%"))), h("tbody", {}, rows)) : h("p", {},
        "No predicted line near it."),
      h("p", {}, h("button", { type: "button", class: "main", disabled: !o.peak || !o.marked.size, onclick: () => this.assign() },
        o.marked.size > 1 ? `Assign as a blend of ${o.marked.size}` : "Assign"), " ",
        h("button", { type: "button", onclick: () => { this.offered = null; this.panels(); } }, "Cancel")),
      this.picker()];
  }
  picker() { // quantum numbers of a level, up and down by the arrow keys: its allowed lines join the candidates
    const o = this.offered, shown = Object.keys(this.species).filter((n) => this.species[n].visible);
    const of = this.pickOf in this.species ? this.pickOf : shown[0] ?? Object.keys(this.species)[0], { names, halves } = this.known(of);
    const select = h("select", { "aria-label": "Species of the level", "data-field": "pickOf",
      onchange: (event) => { this.pickOf = event.target.value; this.panels(); } },
      Object.entries(this.species).map(([n, species]) => h("option", { value: n, selected: n === of }, species.name)));
    const start = o.candidates.find((c) => String(c.species) === of)?.upper ?? names.map(() => 0);
    const words = this.level?.of === of ? this.level.words : names.map((name, i) => quantum(start[i], name, halves));
    const pick = async () => {
      try {
        const level = words.map((word, i) => number(word.trim(), names[i], halves));
        const { candidates } = await this.transport.call({ do: "pick", species: Number(of), level });
        if (this.offered !== o) return;
        const marked = new Set([...o.marked].map((i) => o.candidates[i])), middle = o.peak?.frequency_mhz ?? (o.first + o.last) / 2;
        o.candidates = o.candidates.filter((c) => !c.picked || marked.has(c));
        o.candidates.push(...candidates.filter((c) => !o.candidates.some((other) => this.same(other, c)))
          .map((c) => ({ ...c, off_mhz: c.frequency_mhz - middle, picked: true })));
        o.marked = new Set(o.candidates.flatMap((c, i) => (marked.has(c) ? [i] : [])));
        this.say(`${candidates.length} allowed lines of ${words.join(" ")} in the band`); this.panels();
      } catch (error) { this.say(error.message, true); }
    };
    const type = (i, text) => { words[i] = text; this.level = { of, words }; };
    const turn = (event, i) => {
      const by = { ArrowUp: 1, ArrowDown: -1 }[event.key];
      if (!by) return;
      event.preventDefault();
      try { event.target.value = quantum(number(words[i].trim(), names[i], halves) + by * (halves.includes(names[i]) ? 2 : 1), names[i], halves); }
      catch (error) { this.say(error.message, true); return; }
      type(i, event.target.value); pick();
    };
    return h("form", { onsubmit: (event) => { event.preventDefault(); pick(); } }, h("h3", {}, "Lines of a level"),
      h("div", { class: "row" }, select, names.map((name, i) => h("label", { class: "quantum" }, headOf(name),
        h("input", { value: words[i], size: 3, "data-field": `pick${i}`, autocomplete: "off",
          oninput: (event) => type(i, event.target.value), onkeydown: (event) => turn(event, i) }))),
        h("button", { title: "the lines of this level that the dipole allows, strongest first" }, "Show")));
  }
  fitSummary() {
    return Object.entries(this.species).map(([number, species]) => h("section", {}, h("h3", {}, this.swatch(number), species.name), species.fit
      ? [h("p", {}, `${species.fit.lines} lines, rms ${fixed(1e3 * species.fit.rms_mhz, 2)} kHz, weighted rms ${fixed(species.fit.weighted_rms, 2)}`),
        species.fit.open.length ? h("p", { class: "wrong" }, `not determined: ${species.fit.open.join(", ")}`) : null,
        species.fit.suspect?.length && this.suspicion(species.fit) ? h("p", { class: "wrong" }, this.suspicion(species.fit), " ",
          h("button", { type: "button", onclick: () => this.selectLine(species.fit.suspect[0], true) }, "Show it")) : null]
      : h("p", {}, `Lines assigned: ${Object.values(this.lines).filter((line) => line.species === Number(number)).length}, not fitted`)));
  }
  panelLines() {
    const all = Object.entries(this.lines).sort((a, b) => a[1].frequency_mhz - b[1].frequency_mhz),
      words = this.filter.toLowerCase().split(/\s+/).filter(Boolean);
    const text = (number,
      line) => `${this.name(line)} ${this.facts[number]?.label ?? ""} ${line.frequency_mhz.toFixed(3)} ${line.comment} ${line.rejected ? "rejected" : ""} ${this.off(number) > 3 ? "far" : ""}`.toLowerCase();
    const shown = all.filter(([number, line]) => words.every((word) => (word === "series" ? inSeries(line, this.settings.series)
      : fits(line, word, this.known(line.species)) ?? text(number, line).includes(word))));
    const search = h("input", { type: "search", "data-field": "filter", value: this.filter,
      placeholder: "filter: Ka=0 dJ=1 J>5, series, far, rejected, name", "aria-label": "Filter",
      title: "Ka=0, J>5 of the upper level, J\">5 of the lower, dJ=1 of their difference; series: lines of the Loomis-Wood rows; far: beyond 3 σ",
      oninput: (event) => { this.filter = event.target.value; this.panels(); } });
    const edit = (name, label) => h("label", {}, label, " ", h("input",
      { type: "number", step: "any", min: "0", "data-field": name, style: "width:6em",
      onchange: (event) => { if (this.picked.size) this.do({ do: "edit", lines: this.numbers(), [name]: Number(event.target.value) });
      } }));
    const tools = this.transport.live && h("div", { class: "row" },
      h("button", { type: "button", onclick: () => this.reject() }, "Reject / accept"),
      h("button", { type: "button", onclick: () => this.remove() }, "Remove"), edit("error_mhz", "error (MHz)"), edit("weight", "weight"),
      h("label", { title: "no assigned peak gets a smaller error" }, "least error (MHz) ",
        h("input", { type: "number", step: "any", min: "0", style: "width:6em", "data-field": "least",
        value: this.settings.least_error_mhz, onchange: (event) => this.do({ do: "settings",
        least_error_mhz: Number(event.target.value) }) })));
    const blends = {};
    for (const [, line] of all) blends[line.blend] = (blends[line.blend] ?? 0) + 1;
    const rows = shown.slice(0, 500).map(([number, line]) => h("tr",
      { class: [this.picked.has(number) ? "marked" : "", line.rejected ? "rejected" : "", this.off(number) > 3 ? "far" : ""].join(" "),
      onclick: (event) => { if (event.target.type !== "checkbox") this.selectLine(number, true); } },
      h("td", {}, h("input", { type: "checkbox", "data-field": `line${number}`, "aria-label": `select ${this.text(line)}`,
        checked: this.picked.has(number),
        onchange: (event) => { event.target.checked ? this.picked.add(number) : this.picked.delete(number); this.line = Number(number);
        this.panels(); } })),
      h("td", {}, this.swatch(line.species), this.text(line), blends[line.blend] > 1 ? h("abbr", { title: "blend" }, " ∪") : ""),
        h("td", { class: "number" }, line.frequency_mhz.toFixed(4)),
        h("td", { class: "number" }, fixed(1e3 * this.facts[number]?.difference_mhz, 1)),
        h("td", { class: "number" }, fixed(1e3 * line.error_mhz, 1))));
    return [search, h("p", { class: "quiet" },
      `${shown.length} of ${all.length} lines${shown.length > 500 ? ", the first 500 shown" : ""}`), tools,
      h("table", {}, h("thead", {}, h("tr", {}, h("th", {}, ""), h("th", {}, "line"), h("th", { class: "number" }, "MHz"),
        h("th", { class: "number" }, "o−c (kHz)"), h("th", { class: "number" }, "σ (kHz)"))), h("tbody", {}, rows))].filter(Boolean);
  }
  off(number) { const line = this.lines[number], d = this.facts[number]?.difference_mhz;
    return d == null ? 0 : Math.abs(d) / line.error_mhz; }
  adder() {
    const input = h("input", { "data-field": "add", placeholder: "OCS   OCS, S=34S   file   SMILES:…", "aria-label": "Molecule",
      title: "a name, a file, SMILES:… or constants; an isotopologue by its isotopes behind a comma" });
    const kelvin = h("input", { type: "number", min: "0.1", step: "any", style: "width:5em", "data-field": "add.kelvin",
      value: Object.values(this.species)[0]?.temperature_k ?? 300 });
    return h("form", { class: "row", onsubmit: (event) => { event.preventDefault();
      if (input.value.trim()) this.do({ do: "add_species", source: input.value.trim(), temperature_k: Number(kelvin.value) }); } }, input,
      h("label", {}, kelvin, " K"), h("button", {}, "Add molecule"));
  }
  searcher() { // rotor assign over the whole spectrum
    const seconds = h("input", { type: "number", min: "1", max: "600", value: "20", style: "width:4.5em", "data-field": "seconds",
      "aria-label": "Seconds of the search" });
    const start = async (event) => { event.preventDefault(); this.say("rotor assign searches the spectrum…");
      await this.do({ do: "search", seconds: Number(seconds.value) }); };
    return h("form", { class: "row", onsubmit: start }, h("button", {}, "Search unknown molecules"), h("label", {}, "for ", seconds, " s"));
  }
  slider(number, name, value, span, message, digits) { // a number with a slider about it: moves the prediction while dragged
    const send = (next, final) => {
      const content = message(next);
      if (final) { this.preview = null; this.sliding = false; this.do({ ...content, species: Number(number) }); return; }
      this.preview = { species: Number(number), ...content }; this.sliding = true;
      for (const w of this.windows) w.load();
      if (this.pane === "wood") this.wood.load();
    };
    const box = h("input", { type: "number", step: "any", value: value.toFixed(digits), "data-field": `${number}.${name}`,
      "aria-label": name, onchange: (event) => send(Number(event.target.value), true) });
    const range = h("input", { type: "range", min: "-1", max: "1", step: "0.002", value: "0", "data-field": `${number}.${name}.s`,
      "aria-label": `${name}, slider`, tabindex: "0",
      oninput: (event) => { const next = value + Number(event.target.value) * span; box.value = next.toFixed(digits); send(next, false); },
      onchange: (event) => send(value + Number(event.target.value) * span, true) });
    return [box, range];
  }
  panelConstants() {
    const live = this.transport.live;
    const parts = Object.entries(this.species).map(([number, species]) => this.speciesPart(number, species));
    const emission = h("label", {}, h("input", { type: "checkbox", "data-field": "emission", checked: this.settings.emission,
      onchange: (event) => this.do({ do: "settings", emission: event.target.checked }) }),
      "emission model over the spectrum (column, velocity, width)");
    return [...parts, live && this.adder(), live && this.searcher(), live && h("p", {}, emission)].filter(Boolean);
  }
  speciesPart(number, species) {
    const reach = this.spans[number] ?? 1e-3, lines = Object.values(this.lines).filter((line) => line.species === Number(number)).length;
    const rows = Object.entries(species.constants).map(([name, value]) => {
      const error = species.errors[name], digits = digitsOf(error, value), before = species.fit?.before?.[name],
        moved = before == null ? null : value - before;
      const span = reach * (Math.abs(value) || Math.abs(Object.values(species.constants)[0]) * 1e-6);
      const free = h("input", { type: "checkbox", "data-field": `${number}.${name}.free`, "aria-label": `${name} free`,
        checked: species.free.includes(name), onchange: (event) => this.do({ do: "free", species: Number(number),
        free: event.target.checked ? [...species.free, name] : species.free.filter((other) => other !== name) }) });
      const [box, range] = this.slider(number, name, value, span, (next) => ({ do: "constants", constants: { [name]: next } }), digits);
      return [h("tr", {}, h("td", {}, free), h("th", { scope: "row" }, name), h("td", {}, box),
        h("td", { class: "number" }, error ? `± ${short(error)}` : "")),
        h("tr", { class: "slide" }, h("td", { colspan: "3" }, range),
        h("td", { class: "number moved", title: "moved by the last fit" },
        moved ? `${moved > 0 ? "+" : "−"}${short(Math.abs(moved))}` : ""))];
    });
    const small = (name, value, span, message, digits, unit) => { const [box, range] = this.slider(number, name, value, span, message,
      digits); return h("div", { class: "knob" }, h("label", {}, name, " ", box, ` ${unit}`), range); };
    const dipole = species.dipole_abc_debye ?? [0, 0, 0], axes = ["μa", "μb", "μc"];
    const add = h("input", { placeholder: "add: DeltaJ, …", "aria-label": "Constant to add", "data-field": `${number}.add`,
      style: "width:9em" });
    return h("details", { open: true, class: "species" }, h("summary", {}, this.swatch(number), species.name,
      h("span", { class: "quiet" }, ` ${lines} lines${species.fit ? `, rms ${fixed(1e3 * species.fit.rms_mhz, 1)} kHz` : ""}`)),
      h("div", { class: "row" }, h("label", {}, h("input", { type: "checkbox", "data-field": `${number}.visible`, checked: species.visible,
        onchange: (event) => this.do({ do: "species", species: Number(number), visible: event.target.checked }) }), "shown"),
        h("label", {}, "colour ", h("select", { "data-field": `${number}.colour`,
          onchange: (event) => this.do({ do: "species", species: Number(number), colour: Number(event.target.value) }) },
          ["blue", "orange", "green", "purple", "ochre", "teal",
          "grey"].map((name, i) => h("option", { value: i, selected: i === species.colour }, name)))),
        h("label", {}, "slider ± ", h("select", { "data-field": `${number}.reach`,
          onchange: (event) => { this.spans[number] = Number(event.target.value); this.panels(); } },
          [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1].map((r) => h("option", { value: r, selected: r === reach },
          `${Number((r * 100).toPrecision(1))} %`)))),
        h("label", { title: "lines split by nuclear spins, where the source has their constants" },
          h("input", { type: "checkbox", "data-field": `${number}.hyperfine`, checked: species.hyperfine,
          onchange: (event) => { const box = event.target; this.do({ do: "species", species: Number(number),
          hyperfine: box.checked }).then((answer) => { if (!answer) box.checked = species.hyperfine; }); } }), "spins"),
        h("button", { type: "button", onclick: () => this.do({ do: "remove_species", species: Number(number) }) }, "Remove")),
      h("table", { class: "constants" }, h("thead", {}, h("tr", {}, h("th", { class: "narrow" }, "free"), h("th", { class: "name" }, ""),
        h("th", {}, "MHz"), h("th", { class: "number" }, "error, moved"))), h("tbody", {}, rows)),
      h("form", { class: "row", onsubmit: (event) => { event.preventDefault();
        if (add.value.trim()) this.do({ do: "free", species: Number(number), free: [...species.free, add.value.trim()] }); } }, add,
        h("button", {}, "Free it")),
      small("T", species.temperature_k, species.temperature_k * 0.9, (next) => ({ do: "species", temperature_k: Math.max(next, 0.1) }), 1, "K"),
      small("height", species.scale, species.scale * 0.95, (next) => ({ do: "species", scale: Math.max(next, 1e-3) }), 2, ""),
      dipole.map((value, i) => small(axes[i], value, Math.max(Math.abs(value), 0.5),
        (next) => ({ do: "species", dipole_abc_debye: dipole.map((old, k) => (k === i ? next : old)) }), 3, "D")),
      this.settings.emission && [small("lg N", Math.log10(species.column_per_cm2), 2,
        (next) => ({ do: "species", column_per_cm2: 10 ** next }), 2, "cm⁻²"),
        small("velocity", species.velocity_km_s, 20, (next) => ({ do: "species", velocity_km_s: next }), 2, "km/s"),
        small("width", species.fwhm_km_s, species.fwhm_km_s * 0.9, (next) => ({ do: "species", fwhm_km_s: Math.max(next, 0.01) }), 2, "km/s")]);
  }
  panelSeries() {
    const now = this.settings.series, first = Object.keys(this.species)[0], number = String(now?.species ?? first ?? "");
    const names = this.quanta[number]?.names ?? [],
      c = this.offered ? [...this.offered.marked].map((i) => this.offered.candidates[i])[0] : this.line != null ? this.lines[this.line] : null;
    const guess = names.map((name) => (["j", "n", "kc", "f",
      "f1"].includes(name) ? (this.quanta[number].halves.includes(name) ? 2 : 1) : 0));
    const head = names.map(headOf).join(" "), known = this.known(number);
    const shown = (value, step) => (value ?? []).map((q, i) => quantum(q, step && names[i] === "species" ? "" : names[i], known.halves)).join(" ");
    const field = (key, label, value) => h("label", { class: "wide" }, label,
      h("input", { "data-field": `series.${key}`, value: shown(value, key === "step"), placeholder: head }));
    const species = h("select", { "aria-label": "Species", "data-field": "series.species" },
      Object.entries(this.species).map(([n, species]) => h("option", { value: n, selected: n === number }, species.name)));
    const from = c && String(c.species) === number ? c : now?.upper?.length ? now : null;
    const upper = field("upper", "upper level", from?.upper), lower = field("lower", "lower level", from?.lower),
      step = field("step", "step of each row", now?.step?.length ? now.step : guess);
    const show = (series) => this.do({ do: "series", series }).then((answer) => { if (answer) { this.showPane("wood"); } });
    const read = (label, step) => numbers(label.querySelector("input").value, this.known(species.value), step);
    const frequencies = h("input", { "data-field": "series.frequencies",
      value: (now?.frequencies_mhz?.length ? now.frequencies_mhz : this.measured).map((f) => f.toFixed(4)).join(" "),
      placeholder: "two or three frequencies (MHz)", "aria-label": "Frequencies" });
    const guarded = (action) => (event) => { event.preventDefault(); try { action(); } catch (error) { this.say(error.message, true); } };
    return [h("h3", {}, "Loomis-Wood rows from the model"), h("form",
      { onsubmit: guarded(() => show({ species: Number(species.value), upper: read(upper), lower: read(lower), step: read(step, true) })) },
      h("label", { class: "wide" }, "species", species), upper, lower, step, h("button", { class: "main" }, "Show rows")),
      h("h3", {}, "From two or three lines, extrapolated"), h("form",
        { onsubmit: guarded(() => { const f = frequencies.value.trim().split(/[\s,]+/).map(Number);
        if (f.length < 2 || f.some((value) => !isFinite(value))) throw new Error("two or three frequencies in MHz are needed");
        show({ frequencies_mhz: f }); }) }, h("label", { class: "wide" }, "frequencies", frequencies), h("button", {}, "Show rows")),
      h("p", { class: "quiet" },
        "Shift and drag over a peak of a row fits it and offers the line of the row. The last fitted peaks stand in the field.")];
  }
  async loadLevels() {
    const out = {};
    for (const number of Object.keys(this.species)) { try { out[number] = await this.transport.call({ do: "levels",
      species: Number(number) }); } catch (error) { this.say(error.message, true); } }
    this.levels = out;
    if (this.tab === "Levels") this.panels();
  }
  panelLevels() {
    if (!this.levels || this.levelsOf !== this.session.revision) { this.levelsOf = this.session.revision; this.loadLevels(); }
    return Object.entries(this.levels ?? {}).filter(([number]) => this.species[number]).map(([number,
      { levels, differences }]) => h("section", {}, h("h3", {}, this.swatch(number), this.species[number].name),
      levels.length ? null : h("p", {}, "No line assigned."),
      levels.length ? h("table", {}, h("thead", {}, h("tr", {}, h("th", {}, "level"), h("th", { class: "number" }, "E/hc (cm⁻¹)"),
        h("th", { class: "number" }, "lines"))), h("tbody", {},
        levels.map((level) => h("tr", {}, h("td", {}, level.label), h("td", { class: "number" }, fixed(level.energy_cm, 6)),
        h("td", { class: "number" }, level.lines))))) : null,
      differences.length ? [h("h3", {}, "Combination differences"),
        h("table", {}, h("thead", {}, h("tr", {}, h("th", {}, "levels (by)"), h("th", { class: "number" }, "observed (MHz)"),
        h("th", { class: "number" }, "o−c (kHz)"))), h("tbody", {},
        differences.map((difference) => h("tr", {}, h("td", {}, `${difference.levels.join(" − ")} (${difference.by})`),
        h("td", { class: "number" }, fixed(difference.observed_mhz, 4)),
        h("td", { class: "number" }, fixed(1e3 * difference.difference_mhz, 1))))))] : null));
  }

  // Keys

  key(event) {
    const alone = !(event.ctrlKey || event.metaKey || event.altKey);
    if (alone && this.root !== document.body) event.stopPropagation(); // the notebook around it has commands on single keys
    if (event.target.matches?.("input:not([type=checkbox]):not([type=range]), select, textarea")) return;
    if (this.helpBox.open && event.key !== "?" ) return;
    if (event.target.matches?.("button, summary, input") && [" ", "Enter"].includes(event.key)) return;
    if (event.target.matches?.("input[type=range]") && event.key.startsWith("Arrow")) return;
    const w = this.active, span = w.last - w.first, control = event.ctrlKey || event.metaKey;
    const move = (part) => w.go(w.first + part * span, w.last + part * span);
    const keys = {
      ArrowLeft: () => move(event.shiftKey ? -1 : -0.1), ArrowRight: () => move(event.shiftKey ? 1 : 0.1), "+": () => this.zoom(0.5),
        "=": () => this.zoom(0.5), "-": () => this.zoom(2),
      ArrowUp: () => this.zoom(0.8), ArrowDown: () => this.zoom(1.25), 0: () => w.go(...this.info.band_mhz),
        Home: () => w.go(...this.info.band_mhz), n: () => this.stepPredicted(1), p: () => this.stepPredicted(-1),
      "]": () => this.stepAssigned(1), "[": () => this.stepAssigned(-1), f: () => this.fitMiddle(), Enter: () => this.assign(),
        a: () => this.choose(!this.choosing), x: () => this.reject(), Delete: () => this.remove(),
      r: () => this.refit(), u: () => this.do({ do: "undo" }), y: () => this.do({ do: "redo" }), w: () => this.twoWindows(),
        m: () => this.do({ do: "settings", overlaid: !this.settings.overlaid }),
      s: () => { this.autoscale = !this.autoscale; for (const w of this.windows) w.draw(); },
        l: () => this.showPane(this.pane === "wood" ? "residuals" : "wood"), t: () => this.turn(), "?": () => this.help(),
      PageDown: () => this.pane === "wood" && this.wood.next(1), PageUp: () => this.pane === "wood" && this.wood.next(-1),
      Escape: () => { this.offered = null; for (const w of this.windows) { w.chosen.visible = false; w.cursor.visible = false;
        } this.choose(false); this.panels(); },
    };
    TABS.forEach((name, i) => { keys[String(i + 1)] = () => this.showTab(name); });
    let action = keys[event.key];
    if (control) action = { z: event.shiftKey ? keys.y : keys.u, Z: keys.y, y: keys.y }[event.key];
    if (!action || event.altKey) return;
    event.preventDefault(); event.stopPropagation();
    action();
  }
}

// --- Starting: a served or exported page says itself where its data are; in notebooks anywidget calls render

export default {
  async render({ model, el }) {
    el.style.height = `${model.get("height") ?? 640}px`;
    const root = h("div");
    el.append(root);
    await new App(root, new WidgetTransport(model)).start();
  },
};

const place = globalThis.document?.querySelector("[data-rotor-view]");
if (place) {
  const data = document.querySelector("#rotor-data");
  const transport = data ? new StaticTransport(JSON.parse(data.textContent)) : new SocketTransport(location.href.replace(/^http/,
    "ws").replace(/[^/]*$/, "socket"));
  const app = new App(document.body, transport);
  globalThis.rotorView = app;
  app.start().catch((error) => { place.textContent = `rotor view: ${error.message}`; });
}
