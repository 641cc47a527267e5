// Paint: strokes over the footage, repainted masks, whole sketches.

import { button, checkbox, choice, fill, h, slider } from "./dom";
import { Drawing } from "./drawing";
import { segment } from "./footage";
import { maskName, strokeName } from "./frames";
import { attempt, say } from "./say";
import { store } from "./store";
import { Viewer, type Tool } from "./viewer";

type What = "strokes" | "mask";
type Shape = "brush" | "line" | "polyline";
type Ink = "animal" | "background" | "eraser";

const setting = {
  what: "strokes" as What,
  shape: "brush" as Shape,
  ink: "animal" as Ink,
  size: 8,
  pressure: true,
};

/** The picture that is drawn on, and the pen. */
class Painter implements Tool {
  cursor = "crosshair";
  drawing: Drawing;
  private last: { x: number; y: number } | null = null;
  private points: { x: number; y: number }[] = [];
  private box: [number, number, number, number] = [0, 0, 0, 0];
  private hover: { x: number; y: number } | null = null;

  constructor(private readonly redraw: () => void) {
    this.drawing = this.opened();
  }

  private opened(): Drawing {
    const mask = setting.what === "mask";
    const name = mask ? maskName(store.frame) : strokeName(store.frame);
    return new Drawing(name, mask, this.redraw);
  }

  /** Takes up the current frame; what was drawn on the one before is saved. */
  turn(): void {
    this.endPolyline();
    void this.drawing.save();
    this.drawing = this.opened();
  }

  private width(event?: PointerEvent): number {
    const pen = setting.pressure && event?.pointerType === "pen" && event.pressure > 0;
    return setting.size * (pen ? 0.3 + 1.4 * event.pressure : 1);
  }

  private ink(context: CanvasRenderingContext2D, width: number): void {
    const erasing = setting.ink === "eraser" && setting.what === "strokes";
    context.globalCompositeOperation = erasing ? "destination-out" : "source-over";
    const white = setting.ink === "animal";
    context.strokeStyle = context.fillStyle = white || erasing ? "#fff" : "#000";
    context.lineWidth = width;
    context.lineCap = context.lineJoin = "round";
  }

  private segment(from: { x: number; y: number }, to: { x: number; y: number }, width: number): void {
    this.drawing.draw((context) => {
      context.save();
      this.ink(context, width);
      context.beginPath();
      context.moveTo(from.x, from.y);
      context.lineTo(to.x + 0.01, to.y);
      context.stroke();
      context.restore();
    });
    this.grow(from, width);
    this.grow(to, width);
  }

  private grow({ x, y }: { x: number; y: number }, width: number): void {
    const r = width / 2 + 2;
    const [a, b, c, d] = this.box;
    this.box = [Math.min(a, x - r), Math.min(b, y - r), Math.max(c, x + r), Math.max(d, y + r)];
  }

  private begin(): void {
    this.box = [Infinity, Infinity, -Infinity, -Infinity];
    this.drawing.begin();
  }

  down(x: number, y: number, event: PointerEvent): void {
    if (setting.shape === "polyline") {
      this.points.push({ x, y });
      if (event.detail >= 2) this.endPolyline();
      return this.redraw();
    }
    this.last = { x, y };
    this.begin();
    if (setting.shape === "brush") this.segment(this.last, this.last, this.width(event));
  }

  move(x: number, y: number, event: PointerEvent): void {
    this.hover = { x, y };
    if (this.last && setting.shape === "brush") {
      this.segment(this.last, { x, y }, this.width(event));
      this.last = { x, y };
    } else {
      this.redraw();
    }
  }

  up(x: number, y: number, event: PointerEvent): void {
    if (!this.last) return;
    if (setting.shape === "line") this.segment(this.last, { x, y }, this.width(event));
    this.last = null;
    this.drawing.finish(this.box);
  }

  endPolyline(): void {
    const points = this.points.splice(0);
    if (points.length < 2) return;
    this.begin();
    points.slice(1).forEach((to, at) => this.segment(points[at]!, to, setting.size));
    this.drawing.finish(this.box);
  }

  paint(context: CanvasRenderingContext2D, scale: number): void {
    context.globalAlpha = setting.what === "mask" ? store.view.maskOpacity : 0.85;
    if (setting.what === "mask") context.globalCompositeOperation = "lighter";
    context.drawImage(this.drawing.canvas, 0, 0);
    context.globalCompositeOperation = "source-over";
    context.globalAlpha = 1;
    context.lineWidth = 1.5 / scale;
    context.strokeStyle = "#ffb020";
    const preview = setting.shape === "polyline" ? this.points : this.last && setting.shape === "line" ? [this.last] : [];
    if (preview.length > 0 && this.hover) {
      context.beginPath();
      for (const { x, y } of [...preview, this.hover]) context.lineTo(x, y);
      context.stroke();
    }
    if (this.hover) {
      context.beginPath();
      context.arc(this.hover.x, this.hover.y, setting.size / 2, 0, 7);
      context.stroke();
    }
  }

  /** What lies on the frame before, as a step of its own. */
  async copyPrevious(): Promise<void> {
    if (store.frame === 0) return say("There is no frame before the first.");
    const mask = setting.what === "mask";
    const name = (mask ? maskName : strokeName)(store.frame - 1);
    if (!store.version(name)) return say("Nothing is drawn on the frame before.");
    const source = new Drawing(name, mask, () => undefined);
    await source.ready;
    const { width, height } = this.drawing.canvas;
    this.drawing.edit([0, 0, width, height], (context) => context.drawImage(source.canvas, 0, 0));
  }

  clear(): void {
    const { width, height } = this.drawing.canvas;
    this.drawing.edit([0, 0, width, height], (context) => {
      context.clearRect(0, 0, width, height);
      if (setting.what === "mask") {
        context.fillStyle = "#000";
        context.fillRect(0, 0, width, height);
      }
    });
  }
}

let painter: Painter | null = null;

/** For shortcuts: what the pen can be told from the keyboard. */
export const pen = {
  undo: () => painter?.drawing.undo(),
  redo: () => painter?.drawing.redo(),
  end: () => painter?.endPolyline(),
  ink: (ink: Ink) => ((setting.ink = ink), store.tell("view")),
  resize: (factor: number) => {
    setting.size = Math.min(200, Math.max(1, Math.round(setting.size * factor + Math.sign(factor - 1))));
    store.tell("view");
  },
  copy: () => painter && attempt(() => painter!.copyPrevious()),
};

export function paint(main: HTMLElement, inspector: HTMLElement): () => void {
  const viewer = new Viewer();
  const { source } = store.opened.settings;
  const sketching = store.opened.footage && !(source.foreground && source.background);
  const dimBefore = store.view.dim;
  store.setView({ dim: sketching ? 0.6 : 0 });
  painter = new Painter(viewer.redraw);
  viewer.tool = painter;
  viewer.showMask = setting.what === "strokes";
  main.append(viewer.canvas);
  const turn = () => {
    painter!.turn();
    viewer.showMask = setting.what === "strokes";
    viewer.redraw();
  };
  const shown = () => {
    const pressed = (on: boolean) => ({ "aria-pressed": String(on) });
    const ink = (name: Ink, text: string) =>
      button(text, () => pen.ink(name), { ...pressed(setting.ink === name), className: `ink ${name}` });
    const inks: [Ink, string][] = [["animal", "Animal"], ["background", "Background"]];
    if (setting.what === "strokes") inks.push(["eraser", "Eraser"]);
    fill(
      inspector,
      h("h2", {}, "Paint"),
      sketching
        ? h("p", {}, "No rectangles are drawn, so the strokes of every frame are the silhouettes: sketch each frame in white.")
        : h("p", {}, "A few strokes where the silhouette is wrong, or the whole mask repainted. Both hold on this frame and teach the frames around it."),
      choice("Draw on", setting.what, [["strokes", "Strokes"], ["mask", "Mask"]], (v) => {
        setting.what = v as What;
        if (setting.what === "mask" && setting.ink === "eraser") setting.ink = "background";
        turn();
        shown();
      }),
      h("div", { className: "row", role: "group", "aria-label": "Ink" }, ...inks.map(([n, t]) => ink(n, t))),
      choice("Pen", setting.shape, [["brush", "Brush"], ["line", "Straight line"], ["polyline", "Polyline (double click ends)"]], (v) => {
        painter!.endPolyline();
        setting.shape = v as Shape;
      }),
      slider(`Size, ${setting.size} pixels`, setting.size, { min: 1, max: 80, step: 1 }, (v) => {
        setting.size = v;
        viewer.redraw();
      }),
      checkbox("Pressure changes the size", setting.pressure, (v) => (setting.pressure = v)),
      h(
        "div",
        { className: "row" },
        button("Undo", () => pen.undo()),
        button("Redo", () => pen.redo()),
        button("Copy previous", () => pen.copy()),
        button("Clear", () => painter!.clear()),
      ),
      h("h3", {}, "View"),
      slider("Dim the footage", store.view.dim, { min: 0, max: 0.95, step: 0.05 }, (v) => store.setView({ dim: v })),
      slider("Mask", store.view.maskOpacity, { min: 0, max: 1, step: 0.05 }, (v) => store.setView({ maskOpacity: v })),
      checkbox("Onion skin", store.view.onion, (v) => store.setView({ onion: v })),
      button("Find silhouettes", () => attempt(async () => {
        await painter!.drawing.save();
        await segment();
        turn();
      }), { className: "main", id: "segment", disabled: store.job !== null }),
    );
  };
  shown();
  const ends = [
    store.on(["frame"], turn),
    store.on(["job"], shown),
    store.on(["view"], () => {
      if (!inspector.contains(document.activeElement) || document.activeElement?.tagName === "BUTTON") shown();
    }),
  ];
  return () => {
    painter?.endPolyline();
    void painter?.drawing.save();
    painter = null;
    ends.forEach((act) => act());
    viewer.end();
    store.setView({ dim: dimBefore });
  };
}
