// The pen: brush, straight lines and polylines on the strokes or the mask of the current frame.

import { Drawing, type Box } from "./drawing";
import { maskName, overlay, strokeName } from "./frames";
import { say } from "./say";
import { store } from "./store";
import type { Tool } from "./viewer";

export type What = "strokes" | "mask";
export type Shape = "brush" | "line" | "polyline";
export type Ink = "animal" | "background" | "eraser";

/** Diameter of the pen, pixels of the footage. */
export const SIZES = { min: 1, max: 120 };

/** How the pen is set; it stays so from frame to frame and from step to step. */
export const setting = {
  what: "strokes" as What,
  shape: "brush" as Shape,
  ink: "animal" as Ink,
  size: 8,
  pressure: true,
};

/** Two taps on one place within this time end a polyline. */
const DOUBLE_MS = 400;
const DOUBLE_PX = 12;

/** The bit of `buttons` that says a pen is turned round. */
const ERASER_END = 32;

interface Point {
  x: number;
  y: number;
}

const name = (frame: number) => (setting.what === "mask" ? maskName : strokeName)(frame);

export class Painter implements Tool {
  readonly cursor = "none";
  drawing: Drawing;
  private last: Point | null = null;
  private points: Point[] = [];
  private tapped = { x: 0, y: 0, time: -Infinity };
  private box: Box = [0, 0, 0, 0];
  private hover: Point | null = null;
  private turned = false;

  constructor(private readonly redraw: () => void) {
    this.drawing = this.opened();
  }

  private opened(): Drawing {
    return Drawing.open(name(store.frame), setting.what === "mask", this.redraw);
  }

  /** Takes up the current frame; what was drawn on the one before is saved. */
  turn(): void {
    this.endPolyline();
    void this.drawing.save();
    this.drawing = this.opened();
  }

  /** Shows what is in the shot, when somebody else has changed it. */
  renew(): void {
    if (this.last === null && this.drawing.outdated) this.drawing = this.opened();
  }

  private width(event?: PointerEvent): number {
    const pen = setting.pressure && event?.pointerType === "pen" && event.pressure > 0;
    return setting.size * (pen ? 0.3 + 1.4 * event.pressure : 1);
  }

  private ink(context: CanvasRenderingContext2D, width: number): void {
    const ink = this.turned ? (setting.what === "mask" ? "background" : "eraser") : setting.ink;
    const erasing = ink === "eraser" && setting.what === "strokes";
    context.globalCompositeOperation = erasing ? "destination-out" : "source-over";
    context.strokeStyle = context.fillStyle = ink === "animal" || erasing ? "#fff" : "#000";
    context.lineWidth = width;
    context.lineCap = context.lineJoin = "round";
  }

  private segment(from: Point, to: Point, width: number): void {
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

  private grow({ x, y }: Point, width: number): void {
    const r = width / 2 + 2;
    const [a, b, c, d] = this.box;
    this.box = [Math.min(a, x - r), Math.min(b, y - r), Math.max(c, x + r), Math.max(d, y + r)];
  }

  private begin(): void {
    this.box = [Infinity, Infinity, -Infinity, -Infinity];
    this.drawing.begin();
  }

  down(x: number, y: number, event: PointerEvent): void {
    this.turned = (event.buttons & ERASER_END) !== 0;
    this.hover = { x, y };
    if (setting.shape === "polyline") return this.corner({ x, y }, event);
    this.last = { x, y };
    this.begin();
    if (setting.shape === "brush") this.segment(this.last, this.last, this.width(event));
  }

  private corner(at: Point, event: PointerEvent): void {
    const { x, y, time } = this.tapped;
    const near = Math.hypot(event.clientX - x, event.clientY - y) < DOUBLE_PX;
    this.tapped = { x: event.clientX, y: event.clientY, time: event.timeStamp };
    if (near && event.timeStamp - time < DOUBLE_MS) return this.endPolyline();
    this.points.push(at);
    this.redraw();
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
    if (event.pointerType === "touch") this.leave();
  }

  /** A second finger came down: what the first began was no stroke. */
  abandon(): void {
    if (!this.last) return;
    this.last = null;
    this.drawing.finish(this.box);
    this.drawing.undo();
  }

  leave(): void {
    this.hover = null;
    this.redraw();
  }

  endPolyline(): void {
    const points = this.points.splice(0);
    if (points.length < 2) return this.redraw();
    this.begin();
    points.slice(1).forEach((to, at) => this.segment(points[at]!, to, setting.size));
    this.drawing.finish(this.box);
  }

  /** Takes the corners away that no line has been drawn through. */
  cancel(): void {
    this.points = [];
    this.redraw();
  }

  paint(context: CanvasRenderingContext2D, scale: number): void {
    if (store.view.onion && setting.what === "strokes") this.paintNeighbours(context);
    context.globalAlpha = setting.what === "mask" ? store.view.maskOpacity : 0.85;
    if (setting.what === "mask") context.globalCompositeOperation = "lighter";
    context.drawImage(this.drawing.canvas, 0, 0);
    context.globalCompositeOperation = "source-over";
    context.globalAlpha = 1;
    this.paintPreview(context, scale);
    if (this.hover) this.paintPen(context, scale, this.hover);
  }

  /** Strokes of the frames before (red) and after (blue). */
  private paintNeighbours(context: CanvasRenderingContext2D): void {
    context.globalAlpha = 0.45;
    for (const [by, colour] of [
      [-1, "#ff5d5d"],
      [1, "#5da9ff"],
    ] as const) {
      const strokes = overlay(strokeName(store.frame + by), colour, this.redraw);
      if (strokes) context.drawImage(strokes, 0, 0, this.drawing.canvas.width, this.drawing.canvas.height);
    }
    context.globalAlpha = 1;
  }

  private paintPreview(context: CanvasRenderingContext2D, scale: number): void {
    const corners = this.last && setting.shape === "line" ? [this.last] : this.points;
    if (corners.length === 0) return;
    context.lineWidth = 1.5 / scale;
    context.strokeStyle = context.fillStyle = "#ffb020";
    context.beginPath();
    for (const { x, y } of this.hover ? [...corners, this.hover] : corners) context.lineTo(x, y);
    context.stroke();
    for (const { x, y } of corners) {
      context.beginPath();
      context.arc(x, y, 3 / scale, 0, 2 * Math.PI);
      context.fill();
    }
  }

  /** The ring of the pen, seen on any ground. */
  private paintPen(context: CanvasRenderingContext2D, scale: number, { x, y }: Point): void {
    for (const [width, colour] of [
      [3, "#000a"],
      [1.5, "#fff"],
    ] as const) {
      context.lineWidth = width / scale;
      context.strokeStyle = colour;
      context.beginPath();
      context.arc(x, y, Math.max(setting.size / 2, 2 / scale), 0, 2 * Math.PI);
      context.stroke();
    }
  }

  /** What lies on the frame before, as a step of its own. */
  async copyPrevious(): Promise<void> {
    if (store.frame === 0) return say("There is no frame before the first.");
    const target = this.drawing;
    const source = Drawing.open(name(store.frame - 1), setting.what === "mask", () => undefined);
    await source.ready;
    if (!source.exists) return say("Nothing is drawn on the frame before.");
    target.edit((context) => context.drawImage(source.canvas, 0, 0));
  }
}
