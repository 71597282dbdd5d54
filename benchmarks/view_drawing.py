"""Bokeh and Plotly in Chromium on the same numbers: size, loading, first picture, a pan step, Loomis-Wood rows, a million points at once.

    python benchmarks/view_drawing.py

Needs bokeh, plotly, playwright and Chromium. 4,000 points and 500 sticks are what `rotor view` draws of 10^6 points in a window.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

COMMON = """
const random = (n) => {
  const x = new Float64Array(n), y = new Float64Array(n);
  for (let i = 0; i < n; i++) { x[i] = 6000 + i * 0.012; y[i] = Math.random() * 0.02 + Math.exp(-((((i % 1000) - 500) / 6) ** 2)); }
  return [x, y];
};
const drawn = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done, 0)));
const median = (list) => list.sort((p, q) => p - q)[list.length >> 1];
async function timed(call, count) {
  const times = [];
  for (let k = 0; k < count; k++) { const begun = performance.now(); await call(k); await drawn(); times.push(performance.now() - begun); }
  return median(times);
}
"""
BOKEH = """
async function run() {
  const out = {}, place = document.querySelector("#p");
  const figure = (width, height) => new Bokeh.Plotting.Figure({ width, height, tools: "", output_backend: "canvas" });
  const show = (one) => timed(() => { place.innerHTML = ""; return Bokeh.Plotting.show(one, place); }, 1);
  let [x, y] = random(4000);
  const line = new Bokeh.ColumnDataSource({ data: { x, y } });
  const some = x.slice(0, 500), zero = new Float64Array(500);
  const sticks = new Bokeh.ColumnDataSource({ data: { x: some, y0: zero, y1: y.slice(0, 500).map((v) => -v) } });
  const f = figure(1200, 400);
  f.line({ field: "x" }, { field: "y" }, { source: line });
  f.segment({ field: "x" }, { field: "y0" }, { field: "x" }, { field: "y1" }, { source: sticks });
  out.first = await show(f);
  out.step = await timed((k) => {
    const [x, y] = random(4000);
    line.data = { x: x.map((v) => v + k), y };
    f.x_range.setv({ start: 6000 + k, end: 6048 + k });
  }, 15);
  const g = figure(600, 800), rows = new Bokeh.ColumnDataSource({ data: { xs: [], ys: [] } });
  g.multi_line({ field: "xs" }, { field: "ys" }, { source: rows });
  await show(g);
  out.loomis_wood = await timed(() => {
    const xs = [], ys = [];
    for (let r = 0; r < 50; r++) { const [x, y] = random(400); xs.push(x); ys.push(y.map((v) => v + r)); }
    rows.data = { xs, ys };
  }, 11);
  [x, y] = random(1e6);
  const big = figure(1200, 400);
  big.line({ field: "x" }, { field: "y" }, { source: new Bokeh.ColumnDataSource({ data: { x, y } }) });
  out.million_first = await show(big);
  out.million_step = await timed((k) => big.x_range.setv({ start: 6000 + k * 100, end: 17000 + k * 100 }), 5);
  return out;
}
"""
PLOTLY = """
async function run() {
  const out = {}, place = document.querySelector("#p");
  const layout = (k) => ({ width: 1200, height: 400, showlegend: false, xaxis: { range: [6000 + k, 6048 + k] } });
  const traces = (k) => {
    const [x, y] = random(4000), sx = [], sy = [];
    for (let i = 0; i < 500; i++) { sx.push(x[i], x[i], null); sy.push(0, -y[i], null); }
    return [{ x: x.map((v) => v + k), y, mode: "lines" }, { x: sx, y: sy, mode: "lines" }];
  };
  out.first = await timed(() => Plotly.newPlot(place, traces(0), layout(0)), 1);
  out.step = await timed((k) => Plotly.react(place, traces(k), layout(k)), 15);
  Plotly.purge(place);
  const rows = () => {
    const xs = [], ys = [];
    for (let r = 0; r < 50; r++) { const [x, y] = random(400); xs.push(...x, null); ys.push(...y.map((v) => v + r), null); }
    return Plotly.react(place, [{ x: xs, y: ys, mode: "lines" }], { width: 600, height: 800 });
  };
  await rows();
  out.loomis_wood = await timed(rows, 11);
  Plotly.purge(place);
  const [x, y] = random(1e6);
  out.million_first = await timed(() => Plotly.newPlot(place, [{ x, y, mode: "lines" }], layout(0)), 1);
  out.million_step = await timed((k) => Plotly.relayout(place, { "xaxis.range": [6000 + k * 100, 17000 + k * 100] }), 5);
  return out;
}
"""


def main() -> None:
    """One row a library."""
    import bokeh
    import plotly
    from playwright.sync_api import sync_playwright

    bokeh_files = [
        Path(bokeh.__file__).parent / "server/static/js" / name for name in ("bokeh.min.js", "bokeh-api.min.js")
    ]
    plotly_files = [Path(plotly.__file__).parent / "package_data/plotly.min.js"]
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    with sync_playwright() as started:
        for name, files, body in (("bokeh", bokeh_files, BOKEH), ("plotly", plotly_files, PLOTLY)):
            browser = started.chromium.launch(executable_path=chromium, args=["--no-sandbox"] if root else [])
            page = browser.new_page()
            page.set_content("<div id=p></div>")
            begun = page.evaluate("performance.now()")
            for file in files:
                page.add_script_tag(path=str(file))
            times = {"loaded": page.evaluate("performance.now()") - begun}
            page.add_script_tag(content=COMMON + body)
            times |= page.evaluate("run()")
            browser.close()
            size = sum(file.stat().st_size for file in files) / 1e6
            print(
                f"{name}: {size:.1f} MB, " + ", ".join(f"{key} {value:.0f} ms" for key, value in times.items()),
                flush=True,
            )


if __name__ == "__main__":
    main()
