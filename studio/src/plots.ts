// Plots as SVG: axes with units, a line at the current frame, a text that says what is shown.

import type { BudgetLine } from "./documents";
import { percent, svg } from "./dom";
import { store } from "./store";

export interface Series {
  name: string;
  values: number[];
}

interface Axis {
  label: string;
  low: number;
  high: number;
}

/** Width and height, pixels at which texts have their size. */
interface Size {
  width: number;
  height: number;
}

const USUAL: Size = { width: 420, height: 200 };
const SQUARE: Size = { width: 420, height: 320 };
/** Of a plot among the controls. */
const NARROW: Size = { width: 270, height: 180 };
/** Of a plot below the whole stage. */
const WIDE: Size = { width: 900, height: 190 };

const LEFT = 48;
const RIGHT = 12;
const TOP = 24;
const BOTTOM = 36;

function range(values: number[], margin = 0.05): [number, number] {
  const real = values.filter(Number.isFinite);
  if (real.length === 0) return [0, 1];
  const low = real.reduce((a, b) => Math.min(a, b));
  const high = real.reduce((a, b) => Math.max(a, b));
  const by = (high - low || 1) * margin;
  return [low - by, high + by];
}

function ticks(low: number, high: number): number[] {
  const rough = (high - low) / 5;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= rough) ?? rough;
  const found: number[] = [];
  for (let v = Math.ceil(low / step) * step; v <= high + 1e-9; v += step) found.push(v);
  return found;
}

const told = (value: number) => String(Number(value.toPrecision(4)));

/** Number of colours of series in the style sheet. */
const COLOURS = 8;

/** How a series is drawn; a sum of the others is dashed. */
const kindOf = (series: Series, at: number) => (series.name === "sum" ? "series-sum" : `series-${at % COLOURS}`);

/** Axes, their ticks and labels. */
class Plot {
  readonly element: SVGElement;
  constructor(
    readonly x: Axis,
    readonly y: Axis,
    title: string,
    readonly size = USUAL,
  ) {
    const { width, height } = size;
    this.element = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": title, class: "plot" });
    this.element.append(svg("title", {}, title));
    for (const v of ticks(x.low, x.high)) {
      const at = this.px(v);
      this.element.append(
        svg("line", { x1: at, x2: at, y1: TOP, y2: height - BOTTOM, class: "grid" }),
        svg("text", { x: at, y: height - BOTTOM + 14, "text-anchor": "middle" }, told(v)),
      );
    }
    for (const v of ticks(y.low, y.high)) {
      const at = this.py(v);
      this.element.append(
        svg("line", { x1: LEFT, x2: width - RIGHT, y1: at, y2: at, class: "grid" }),
        svg("text", { x: LEFT - 6, y: at + 4, "text-anchor": "end" }, told(v)),
      );
    }
    const middle = (TOP + height - BOTTOM) / 2;
    this.element.append(
      svg("text", { x: (LEFT + width - RIGHT) / 2, y: height - 6, "text-anchor": "middle", class: "label" }, x.label),
      svg(
        "text",
        { x: 12, y: middle, transform: `rotate(-90 12 ${middle})`, "text-anchor": "middle", class: "label" },
        y.label,
      ),
    );
  }

  px(v: number): number {
    return LEFT + ((v - this.x.low) / (this.x.high - this.x.low)) * (this.size.width - LEFT - RIGHT);
  }

  py(v: number): number {
    const h = this.size.height - TOP - BOTTOM;
    return TOP + h - ((v - this.y.low) / (this.y.high - this.y.low)) * h;
  }

  path(xs: number[], ys: number[], kind: string): void {
    let d = "";
    xs.forEach((x, at) => {
      const y = ys[at] ?? NaN;
      if (!Number.isFinite(x) || !Number.isFinite(y)) return;
      d += `${d ? "L" : "M"}${this.px(x).toFixed(1)} ${this.py(y).toFixed(1)}`;
    });
    this.element.append(svg("path", { d, class: `line ${kind}` }));
  }

  /** The names of the series above the plot, each in its colour. */
  legend(series: Series[]): void {
    let x = LEFT;
    series.forEach((s, at) => {
      const kind = kindOf(s, at);
      this.element.append(
        svg("line", { x1: x, x2: x + 14, y1: 10, y2: 10, class: `line ${kind}` }),
        svg("text", { x: x + 18, y: 14 }, s.name),
      );
      x += 30 + 7 * s.name.length;
    });
  }

  /** Calls `act` with where the pointer is, in the plot's own pixels, while it is down. */
  whenPointed(act: (x: number, y: number) => void): void {
    this.element.classList.add("live");
    const point = (event: PointerEvent) => {
      const box = this.element.getBoundingClientRect();
      // The drawing keeps its proportions within the box.
      const scale = Math.min(box.width / this.size.width, box.height / this.size.height);
      const left = box.left + (box.width - scale * this.size.width) / 2;
      const top = box.top + (box.height - scale * this.size.height) / 2;
      act((event.clientX - left) / scale, (event.clientY - top) / scale);
    };
    this.element.addEventListener("pointerdown", (event) => {
      this.element.setPointerCapture(event.pointerId);
      point(event);
    });
    this.element.addEventListener("pointermove", (event) => {
      if (this.element.hasPointerCapture(event.pointerId)) point(event);
    });
  }
}

/** Several series over the frames; the pointer scrubs. The function moves the mark of the current frame. */
export function overFrames(title: string, label: string, series: Series[], wide = false): [SVGElement, () => void] {
  const last = Math.max(1, (series[0]?.values.length ?? 2) - 1);
  const [low, high] = range(series.flatMap((s) => s.values));
  const plot = new Plot({ label: "frame", low: 0, high: last }, { label, low, high }, title, wide ? WIDE : USUAL);
  const frames = Array.from({ length: last + 1 }, (_, t) => t);
  series.forEach((s, at) => plot.path(frames, s.values, kindOf(s, at)));
  plot.legend(series);
  const { width, height } = plot.size;
  const cursor = svg("line", { y1: TOP, y2: height - BOTTOM, class: "cursor" });
  plot.element.append(cursor);
  plot.whenPointed((x) => store.setFrame(((x - LEFT) / (width - LEFT - RIGHT)) * last));
  const move = () => {
    cursor.setAttribute("x1", String(plot.px(store.frame)));
    cursor.setAttribute("x2", String(plot.px(store.frame)));
  };
  move();
  return [plot.element, move];
}

/** The way of the frames through the first two components, the current one marked; the pointer goes to the nearest. */
export function trajectory(x: number[], y: number[], keys: { key: number; frame: number }[]): [SVGElement, () => void] {
  const span = Math.max(...range([...x, ...y]).map(Math.abs));
  const wide = (span * (SQUARE.width - LEFT - RIGHT)) / (SQUARE.height - TOP - BOTTOM);
  const plot = new Plot(
    { label: "PC1, standard deviations", low: -wide, high: wide },
    { label: "PC2, standard deviations", low: -span, high: span },
    "The way of the frames through the first two components; the keys are numbered, a dot marks the current frame",
    SQUARE,
  );
  plot.path(x, y, "series-0 thin");
  const place = (t: number): [number, number] => [plot.px(x[t] ?? 0), plot.py(y[t] ?? 0)];
  const shown = x.flatMap((v, t) => (Number.isFinite(v) && Number.isFinite(y[t]) ? [t] : []));
  for (const t of shown) {
    const [cx, cy] = place(t);
    plot.element.append(svg("circle", { cx, cy, r: 1.8, class: "sample" }));
  }
  const dot = svg("circle", { r: 6, class: "dot" });
  plot.element.append(dot);
  for (const { key, frame } of keys) {
    const [cx, cy] = place(frame);
    plot.element.append(
      svg("circle", { cx, cy, r: 9, class: "keymark" }),
      svg("text", { x: cx, y: cy + 4, "text-anchor": "middle", class: "keytext" }, String(key)),
    );
  }
  plot.whenPointed((px, py) => {
    const away = (t: number) => Math.hypot(place(t)[0] - px, place(t)[1] - py);
    const nearest = shown.reduce((a, b) => (away(b) < away(a) ? b : a), shown[0] ?? 0);
    store.setFrame(nearest);
  });
  const move = () => {
    const [cx, cy] = place(store.frame);
    dot.setAttribute("cx", String(cx));
    dot.setAttribute("cy", String(cy));
  };
  move();
  return [plot.element, move];
}

/** Amplitudes over frequency with the band shaded. */
export function spectrum(hz: number[], series: Series[], band: [number, number], f0: number): SVGElement {
  const to = Math.min(hz[hz.length - 1] ?? 1, Math.max(6 * f0, 1.5 * band[1]));
  const shown = hz.filter((f) => f <= to).length;
  const high = range(series.flatMap((s) => s.values.slice(0, shown)))[1];
  const plot = new Plot(
    { label: "frequency, Hz", low: 0, high: to },
    { label: "amplitude, standard deviations", low: 0, high },
    `Spectrum of the components; the band about ${f0.toFixed(2)} Hz is shaded`,
  );
  const [left, right] = [plot.px(Math.max(0, band[0])), plot.px(Math.min(to, band[1]))];
  const { height } = plot.size;
  plot.element.append(
    svg("rect", { x: left, width: Math.max(1, right - left), y: TOP, height: height - TOP - BOTTOM, class: "band" }),
  );
  series.forEach((s, at) => plot.path(hz.slice(0, shown), s.values.slice(0, shown), kindOf(s, at)));
  plot.legend(series);
  return plot.element;
}

/** Expected error over the number of poses; those there are now are marked. */
export function budget(lines: BudgetLine[], now: number): SVGElement {
  const high = range([0, ...lines.map((l) => 100 * l.expected_error_share)])[1];
  const plot = new Plot(
    { label: "number of poses", low: 1, high: Math.max(3, ...lines.map((l) => l.keys)) + 1 },
    { label: "error, % of the motion", low: 0, high },
    `Expected error, as a share of the motion, over the number of poses: ${lines.map((l) => `${l.keys} poses ${percent(l.expected_error_share)}`).join(", ")}`,
    NARROW,
  );
  plot.path(
    lines.map((l) => l.keys),
    lines.map((l) => 100 * l.expected_error_share),
    "series-0",
  );
  for (const { keys, expected_error_share } of lines) {
    const at = { cx: plot.px(keys), cy: plot.py(100 * expected_error_share) };
    plot.element.append(svg("circle", { ...at, r: keys === now ? 6 : 3, class: keys === now ? "dot" : "sample" }));
  }
  return plot.element;
}
