// Footage: look at it, draw the two rectangles, find the silhouettes.

import type { Rectangle } from "./api";
import { button, fill, group, h } from "./dom";
import { attempt, say } from "./say";
import { maskView, segment } from "./silhouettes";
import { store } from "./store";
import { Viewer, type Tool } from "./viewer";

type Side = "foreground" | "background";

const COLOURS: Record<Side, string> = { foreground: "#4ade80", background: "#f87171" };
const WORDS: Record<Side, string> = { foreground: "Animal", background: "Background" };

/** Draws and changes the two rectangles on the first frame. */
class Rectangles implements Tool {
  side: Side = "foreground";
  cursor = "crosshair";
  private start: [number, number] | null = null;
  private drawn: Rectangle | null = null;

  constructor(
    private readonly redraw: () => void,
    private readonly told: () => void,
  ) {}

  down(x: number, y: number): void {
    if (store.frame !== 0) {
      say("The rectangles belong to the first frame; it is shown now.");
      store.setFrame(0);
      return;
    }
    this.start = [x, y];
  }

  move(x: number, y: number): void {
    if (!this.start) return;
    const { width, height } = store.opened;
    const inside = (v: number, most: number) => Math.round(Math.min(most, Math.max(0, v)));
    const [x0, x1] = [this.start[0], x].map((v) => inside(v, width)).sort((a, b) => a - b);
    const [y0, y1] = [this.start[1], y].map((v) => inside(v, height)).sort((a, b) => a - b);
    this.drawn = [x0!, y0!, x1! - x0!, y1! - y0!];
    this.redraw();
  }

  up(): void {
    const drawn = this.drawn;
    this.abandon();
    if (!drawn || drawn[2] < 2 || drawn[3] < 2) return;
    const side = this.side;
    // The other one is drawn next, as long as it is missing.
    const other = side === "foreground" ? "background" : "foreground";
    if (!store.opened.settings.source[other]) this.side = other;
    this.told();
    attempt(() => store.change(() => ({ [`source.${side}`]: drawn })));
  }

  abandon(): void {
    this.start = this.drawn = null;
    this.redraw();
  }

  paint(context: CanvasRenderingContext2D, scale: number): void {
    if (store.frame !== 0) return;
    for (const side of ["foreground", "background"] as const) {
      const r = (this.side === side ? this.drawn : null) ?? store.opened.settings.source[side];
      if (!r) continue;
      context.lineWidth = 2 / scale;
      context.strokeStyle = COLOURS[side];
      context.setLineDash(side === "background" ? [8 / scale, 5 / scale] : []);
      context.strokeRect(...r);
      context.setLineDash([]);
      this.label(context, WORDS[side], r[0], r[1], scale, COLOURS[side]);
    }
  }

  private label(
    context: CanvasRenderingContext2D,
    text: string,
    x: number,
    y: number,
    scale: number,
    colour: string,
  ): void {
    context.font = `600 ${12 / scale}px system-ui, sans-serif`;
    const wide = context.measureText(text).width + 10 / scale;
    // Beside the right edge it stays in the picture.
    const left = Math.max(0, Math.min(x - 1 / scale, store.opened.width - wide));
    context.fillStyle = colour;
    context.fillRect(left, y, wide, 18 / scale);
    context.fillStyle = "#10151c";
    context.fillText(text, left + 5 / scale, y + 13 / scale);
  }
}

export function footage(main: HTMLElement, inspector: HTMLElement): () => void {
  const viewer = new Viewer();
  const tool = new Rectangles(viewer.redraw, () => draw());
  viewer.tool = store.opened.footage ? tool : null;
  main.append(viewer.element);

  const rectangles = () => {
    const { source } = store.opened.settings;
    const told = (r: Rectangle | null) => (r ? `${r[2]} × ${r[3]} at ${r[0]}, ${r[1]}` : "not drawn yet");
    const pick = (side: Side) =>
      button(WORDS[side], () => ((tool.side = side), draw()), {
        "aria-pressed": String(tool.side === side),
        className: `pick ${side}`,
      });
    return [
      h(
        "p",
        { className: "lead" },
        "Two rectangles on the first frame: drag one inside the animal and one where it is not.",
      ),
      group("Draw", pick("foreground"), pick("background")),
      h(
        "dl",
        {},
        ...(["foreground", "background"] as const).flatMap((side) => [
          h("dt", {}, WORDS[side]),
          h("dd", {}, told(source[side])),
        ]),
      ),
    ];
  };
  const draw = () => {
    const { source } = store.opened.settings;
    const has = store.opened.footage;
    const missing = has && !(source.foreground && source.background);
    fill(
      inspector,
      h("h2", {}, "Footage"),
      h("p", { className: "facts" }, facts()),
      store.opened.footage_problem ? h("p", { className: "fault" }, store.opened.footage_problem) : null,
      ...(has ? rectangles() : []),
      button("Find silhouettes", () => attempt(() => segment()), {
        className: "main",
        id: "segment",
        disabled: store.job !== null || (missing && !hasStrokes()),
      }),
      missing ? h("p", { className: "hint" }, "Without rectangles, sketch every frame under Paint instead.") : null,
      h("h3", {}, "View"),
      ...maskView(),
    );
  };
  draw();
  const ends = [store.on(["files", "job", "shot"], draw)];
  return () => {
    viewer.end();
    ends.forEach((act) => act());
  };
}

function hasStrokes(): boolean {
  return Object.keys(store.opened.files).some((name) => name.startsWith("strokes/"));
}

function facts(): string {
  const { width, height, frames, fps } = store.opened;
  return `${width} × ${height} pixels, ${frames} frames, ${Number(fps.toFixed(3))} a second`;
}
