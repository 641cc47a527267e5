// Plots as SVG: axes with units, a line at the current frame, a text that says what is shown.

import { svg } from "./dom";
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

const WIDTH = 460;
const HEIGHT = 210;
const LEFT = 48;
const RIGHT = 12;
const TOP = 22;
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

class Frame {
  readonly element: SVGElement;
  constructor(
    readonly x: Axis,
    readonly y: Axis,
    title: string,
    readonly height = HEIGHT,
  ) {
    this.element = svg("svg", {
      viewBox: `0 0 ${WIDTH} ${height}`,
      role: "img",
      "aria-label": title,
      class: "plot",
    });
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
        svg("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: at, y2: at, class: "grid" }),
        svg("text", { x: LEFT - 6, y: at + 4, "text-anchor": "end" }, told(v)),
      );
    }
    const middle = (TOP + height - BOTTOM) / 2;
    this.element.append(
      svg("text", { x: (LEFT + WIDTH - RIGHT) / 2, y: height - 6, "text-anchor": "middle", class: "label" }, x.label),
      svg(
        "text",
        { x: 12, y: middle, transform: `rotate(-90 12 ${middle})`, "text-anchor": "middle", class: "label" },
        y.label,
      ),
    );
  }

  px(v: number): number {
    return LEFT + ((v - this.x.low) / (this.x.high - this.x.low)) * (WIDTH - LEFT - RIGHT);
  }

  py(v: number): number {
    const h = this.height - TOP - BOTTOM;
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
}

/** Several series over the frames; clicking goes there. */
export function overFrames(title: string, label: string, series: Series[]): [SVGElement, () => void] {
  const last = Math.max(1, (series[0]?.values.length ?? 2) - 1);
  const [low, high] = range(series.flatMap((s) => s.values));
  const frame = new Frame({ label: "frame", low: 0, high: last }, { label, low, high }, title);
  series.forEach((s, at) => {
    frame.path(s.values.map((_, t) => t), s.values, `series-${at % 6}`);
    frame.element.append(
      svg("text", { x: LEFT + 52 * at, y: 13, class: `key series-${at % 6}` }, s.name),
    );
  });
  const cursor = svg("line", { y1: TOP, y2: HEIGHT - BOTTOM, class: "cursor" });
  frame.element.append(cursor);
  frame.element.addEventListener("click", (event) => {
    const box = frame.element.getBoundingClientRect();
    const x = (((event as MouseEvent).clientX - box.left) / box.width) * WIDTH;
    store.setFrame(((x - LEFT) / (WIDTH - LEFT - RIGHT)) * last);
  });
  const move = () => {
    cursor.setAttribute("x1", String(frame.px(store.frame)));
    cursor.setAttribute("x2", String(frame.px(store.frame)));
  };
  move();
  return [frame.element, move];
}

/** The way of the frames through the first two components, the current one marked. */
export function trajectory(x: number[], y: number[], keys: { key: number; frame: number }[]): [SVGElement, () => void] {
  const span = Math.max(...range([...x, ...y]).map(Math.abs));
  const wide = (span * (WIDTH - LEFT - RIGHT)) / (320 - TOP - BOTTOM);
  const frame = new Frame(
    { label: "PC1, standard deviations", low: -wide, high: wide },
    { label: "PC2, standard deviations", low: -span, high: span },
    "The way of the frames through the first two components; the keys are numbered, a dot marks the current frame",
    320,
  );
  frame.path(x, y, "series-0");
  for (const { key, frame: t } of keys) {
    const at = { cx: frame.px(x[t] ?? 0), cy: frame.py(y[t] ?? 0) };
    frame.element.append(
      svg("circle", { ...at, r: 9, class: "keymark" }),
      svg("text", { x: at.cx, y: at.cy + 4, "text-anchor": "middle", class: "keytext" }, String(key)),
    );
  }
  const dot = svg("circle", { r: 6, class: "dot" });
  frame.element.append(dot);
  const move = () => {
    dot.setAttribute("cx", String(frame.px(x[store.frame] ?? 0)));
    dot.setAttribute("cy", String(frame.py(y[store.frame] ?? 0)));
  };
  move();
  return [frame.element, move];
}

/** Amplitudes over frequency with the band shaded. */
export function spectrum(hz: number[], series: Series[], band: [number, number], f0: number): SVGElement {
  const to = Math.min(hz[hz.length - 1] ?? 1, Math.max(6 * f0, 1.5 * band[1]));
  const shown = hz.filter((f) => f <= to).length;
  const high = range(series.flatMap((s) => s.values.slice(0, shown)))[1];
  const frame = new Frame(
    { label: "frequency, hertz", low: 0, high: to },
    { label: "amplitude", low: 0, high },
    `Spectrum of the components; the band about ${f0.toFixed(2)} hertz is shaded`,
  );
  const [left, right] = [frame.px(Math.max(0, band[0])), frame.px(Math.min(to, band[1]))];
  frame.element.append(
    svg("rect", { x: left, width: Math.max(1, right - left), y: TOP, height: HEIGHT - TOP - BOTTOM, class: "band" }),
  );
  series.forEach((s, at) => {
    frame.path(hz.slice(0, shown), s.values.slice(0, shown), `series-${at}`);
    frame.element.append(
      svg("text", { x: LEFT + 52 * at, y: 13, class: `key series-${at}` }, s.name),
    );
  });
  return frame.element;
}

/** Expected error over the number of poses. */
export function budget(lines: { keys: number; expected_error_share: number }[]): SVGElement {
  const high = range([0, ...lines.map((l) => 100 * l.expected_error_share)])[1];
  const frame = new Frame(
    { label: "number of poses", low: 1, high: Math.max(3, ...lines.map((l) => l.keys)) + 1 },
    { label: "expected error, %", low: 0, high },
    "Expected error, as a share of the motion, over the number of poses",
  );
  frame.path(lines.map((l) => l.keys), lines.map((l) => 100 * l.expected_error_share), "series-0");
  return frame.element;
}
