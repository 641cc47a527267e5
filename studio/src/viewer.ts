// The picture of the current frame with what lies over it: zoom, pan, scrubbing by wheel.

import { button, coalesced, h } from "./dom";
import * as frames from "./frames";
import { store } from "./store";

export interface Tool {
  /** Draws over the picture, in pixels of the footage. */
  paint(context: CanvasRenderingContext2D, scale: number): void;
  down?(x: number, y: number, event: PointerEvent): void;
  move?(x: number, y: number, event: PointerEvent): void;
  up?(x: number, y: number, event: PointerEvent): void;
  /** What `down` began turned out to be the start of a gesture. */
  abandon?(): void;
  /** The pointer has left the picture. */
  leave?(): void;
  cursor?: string;
}

const MOST_ZOOM = 16;

/** A notch of a mouse's wheel is one frame; a touch pad sends many small steps. */
const NOTCH_PX = 50;
const FRAME_PX = 30;

let travelled = 0;

/** Scrubs by the wheel. */
export function scrubByWheel(event: WheelEvent): void {
  event.preventDefault();
  const by = event.deltaY || event.deltaX;
  if (event.deltaMode !== WheelEvent.DOM_DELTA_PIXEL || Math.abs(by) >= NOTCH_PX) {
    travelled = 0;
    return store.setFrame(store.frame + Math.sign(by));
  }
  if (Math.sign(by) !== Math.sign(travelled)) travelled = 0;
  travelled += by;
  const steps = Math.trunc(travelled / FRAME_PX);
  travelled -= steps * FRAME_PX;
  if (steps !== 0) store.setFrame(store.frame + steps);
}

interface Point {
  x: number;
  y: number;
}

export class Viewer {
  readonly canvas = h("canvas", { className: "viewer", tabIndex: 0, role: "img" });
  readonly element: HTMLElement;
  tool: Tool | null = null;
  showMask = true;
  private zoom = 1;
  private offset: Point = { x: 0, y: 0 };
  private panning: Point | null = null;
  /** Fingers that are down, by their number; two of them zoom and move the picture. */
  private fingers = new Map<number, Point>();
  private pinched = false;
  private size = { width: 0, height: 0 };
  private direction = 1;
  private lastFrame = 0;
  private readonly percent = h("output", { className: "zoom" });
  readonly redraw = coalesced(() => this.draw());
  private ends: (() => void)[] = [];

  constructor() {
    const zoomed = (by: number) => () => this.zoomAt(this.size.width / 2, this.size.height / 2, by);
    const tool = (label: string, words: string, act: () => void) =>
      button(label, act, { "aria-label": words, title: words });
    this.element = h(
      "div",
      { className: "picture" },
      this.canvas,
      h(
        "div",
        { className: "zoomer", role: "group", "aria-label": "Zoom" },
        tool("−", "Zoom out", zoomed(1 / 1.5)),
        this.percent,
        tool("+", "Zoom in", zoomed(1.5)),
        tool("Fit", "Show the whole picture", () => this.fit()),
      ),
    );
    const observer = new ResizeObserver(([entry]) => this.resized(entry!.contentRect));
    observer.observe(this.canvas);
    this.ends.push(() => observer.disconnect());
    this.ends.push(store.on(["frame"], () => this.moved()));
    this.ends.push(store.on(["files", "view", "shot"], this.redraw));
    this.listen();
    this.moved();
  }

  private listen(): void {
    const on = <Name extends keyof HTMLElementEventMap>(name: Name, act: (event: HTMLElementEventMap[Name]) => void) =>
      this.canvas.addEventListener(name, act, { passive: false });
    on("wheel", (event) => this.wheel(event));
    on("pointerdown", (event) => this.pointerDown(event));
    on("pointermove", (event) => this.pointerMove(event));
    on("pointerup", (event) => this.pointerUp(event));
    on("pointercancel", (event) => this.pointerUp(event));
    on("pointerleave", () => this.tool?.leave?.());
  }

  end(): void {
    for (const act of this.ends) act();
  }

  fit(): void {
    this.zoom = 1;
    this.offset = { x: 0, y: 0 };
    this.redraw();
  }

  private resized({ width, height }: DOMRectReadOnly): void {
    this.size = { width, height };
    this.canvas.width = Math.max(1, Math.round(width * devicePixelRatio));
    this.canvas.height = Math.max(1, Math.round(height * devicePixelRatio));
    this.draw();
  }

  private moved(): void {
    this.direction = Math.sign(store.frame - this.lastFrame) || this.direction;
    this.lastFrame = store.frame;
    this.draw();
    frames.prefetch(store.frame, this.direction, () => this.draw());
  }

  /** Screen pixels a pixel of the footage, and where its first pixel is. */
  private place(): { scale: number; x: number; y: number } {
    const { width, height } = store.opened;
    const fitting = Math.min(this.size.width / width, this.size.height / height) || 1;
    const scale = fitting * this.zoom;
    return {
      scale,
      x: (this.size.width - width * scale) / 2 + this.offset.x,
      y: (this.size.height - height * scale) / 2 + this.offset.y,
    };
  }

  private at(event: MouseEvent): [number, number] {
    const box = this.canvas.getBoundingClientRect();
    const { scale, x, y } = this.place();
    return [(event.clientX - box.left - x) / scale, (event.clientY - box.top - y) / scale];
  }

  /** Zooms by a factor; the point of the canvas stays where it is. */
  private zoomAt(x: number, y: number, by: number): void {
    const before = this.place();
    this.zoom = Math.min(MOST_ZOOM, Math.max(1, this.zoom * by));
    const after = this.place();
    const grown = after.scale / before.scale;
    this.offset.x += (x - before.x) * (1 - grown) + before.x - after.x;
    this.offset.y += (y - before.y) * (1 - grown) + before.y - after.y;
    if (this.zoom === 1) this.offset = { x: 0, y: 0 };
    this.redraw();
  }

  private wheel(event: WheelEvent): void {
    if (!event.ctrlKey && !event.metaKey) return scrubByWheel(event);
    event.preventDefault();
    this.zoomAt(event.offsetX, event.offsetY, Math.exp(-event.deltaY / 300));
  }

  private pointerDown(event: PointerEvent): void {
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.focus({ preventScroll: true });
    if (event.pointerType === "touch") this.fingers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    if (this.fingers.size === 2) {
      this.pinched = true;
      this.tool?.abandon?.();
    } else if (event.button === 1 || (event.button === 0 && event.altKey)) {
      this.panning = { x: event.clientX - this.offset.x, y: event.clientY - this.offset.y };
      event.preventDefault();
    } else if ((event.button === 0 || event.button === 5) && !this.pinched) {
      this.tool?.down?.(...this.at(event), event);
    }
  }

  private pointerMove(event: PointerEvent): void {
    if (this.pinched) return this.pinch(event);
    if (this.panning) {
      this.offset = { x: event.clientX - this.panning.x, y: event.clientY - this.panning.y };
      return this.redraw();
    }
    // All positions of the pen since the last event, not only the newest.
    const all = event.getCoalescedEvents?.() ?? [];
    for (const each of all.length > 0 ? all : [event]) this.tool?.move?.(...this.at(each), each);
  }

  /** Two fingers: what lies between them stays between them. */
  private pinch(event: PointerEvent): void {
    const own = this.fingers.get(event.pointerId);
    const other = [...this.fingers].find(([id]) => id !== event.pointerId)?.[1];
    if (!own || !other) return;
    const now = { x: event.offsetX, y: event.offsetY };
    const distance = (a: Point, b: Point) => Math.max(1, Math.hypot(a.x - b.x, a.y - b.y));
    this.offset.x += (now.x - own.x) / 2;
    this.offset.y += (now.y - own.y) / 2;
    this.zoomAt((now.x + other.x) / 2, (now.y + other.y) / 2, distance(now, other) / distance(own, other));
    this.fingers.set(event.pointerId, now);
  }

  private pointerUp(event: PointerEvent): void {
    this.fingers.delete(event.pointerId);
    if (this.pinched) this.pinched = this.fingers.size > 0;
    else if (this.panning) this.panning = null;
    else this.tool?.up?.(...this.at(event), event);
  }

  private draw(): void {
    if (!store.shot || this.size.width === 0) return;
    const { width, height, footage, frames: count } = store.shot;
    const context = this.canvas.getContext("2d")!;
    const { scale, x, y } = this.place();
    const ratio = devicePixelRatio;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.setTransform(scale * ratio, 0, 0, scale * ratio, x * ratio, y * ratio);
    context.fillStyle = "#000";
    context.fillRect(0, 0, width, height);
    const shown = footage ? this.footage(scale * ratio) : undefined;
    // Pixels that are looked at closely are seen as they are.
    context.imageSmoothingEnabled = scale * ratio < 3;
    if (shown) context.drawImage(shown, 0, 0, width, height);
    if (store.view.dim > 0) {
      context.fillStyle = `rgba(0, 0, 0, ${store.view.dim})`;
      context.fillRect(0, 0, width, height);
    }
    if (this.showMask) this.drawMasks(context, this.isClose(scale * ratio));
    this.tool?.paint(context, scale);
    this.canvas.style.cursor = this.tool?.cursor ?? "default";
    this.percent.textContent = `${Math.round(100 * scale * ratio)} %`;
    const what = shown || !footage ? "" : ", loading";
    this.canvas.setAttribute("aria-label", `Frame ${store.frame} of ${count}${what}`);
    this.canvas.dataset["frame"] = shown || !footage ? String(store.frame) : "";
  }

  /** Whether more can be seen, at a scale, than the pictures hold that are fetched for scrubbing. */
  private isClose(scale: number): boolean {
    const fetched = frames.fetchedWidth();
    return fetched < store.opened.width && scale * store.opened.width > 1.1 * fetched;
  }

  /** The current frame, at full width where that can be seen. */
  private footage(scale: number): ImageBitmap | undefined {
    const usual = frames.picture(store.frame);
    return (this.isClose(scale) && usual && frames.detail(store.frame, this.redraw)) || usual;
  }

  private drawMasks(context: CanvasRenderingContext2D, close: boolean): void {
    const { width, height, footage } = store.opened;
    const lay = (frame: number, colour: string, opacity: number) => {
      const mask = frames.overlay(frames.maskName(frame), colour, this.redraw, close);
      if (!mask) return;
      context.globalAlpha = opacity;
      context.drawImage(mask, 0, 0, width, height);
      context.globalAlpha = 1;
    };
    if (store.view.onion) {
      lay(store.frame - 1, "#ff5d5d", 0.3);
      lay(store.frame + 1, "#5da9ff", 0.3);
    }
    // Without footage the mask is all there is to see.
    const opacity = footage ? store.view.maskOpacity : 1;
    if (opacity > 0) lay(store.frame, footage ? frames.MASK_COLOUR : "#ffffff", opacity);
  }
}
