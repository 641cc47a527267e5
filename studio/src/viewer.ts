// The picture of the current frame with what lies over it: zoom, pan, scrubbing by wheel.

import { coalesced, h } from "./dom";
import * as frames from "./frames";
import { store } from "./store";

export interface Tool {
  /** Draws over the picture, in pixels of the footage. */
  paint(context: CanvasRenderingContext2D, scale: number): void;
  down?(x: number, y: number, event: PointerEvent): void;
  move?(x: number, y: number, event: PointerEvent): void;
  up?(x: number, y: number, event: PointerEvent): void;
  cursor?: string;
}

const tinted = new WeakMap<ImageBitmap, Map<string, HTMLCanvasElement>>();

/** A mask as a picture of one colour, clear where the animal is not. */
function coloured(mask: ImageBitmap, colour: string): HTMLCanvasElement {
  const known = tinted.get(mask) ?? new Map<string, HTMLCanvasElement>();
  tinted.set(mask, known);
  const found = known.get(colour);
  if (found) return found;
  const canvas = h("canvas", { width: mask.width, height: mask.height });
  const context = canvas.getContext("2d")!;
  context.drawImage(mask, 0, 0);
  const image = context.getImageData(0, 0, mask.width, mask.height);
  for (let at = 0; at < image.data.length; at += 4) image.data[at + 3] = image.data[at]!;
  context.putImageData(image, 0, 0);
  context.globalCompositeOperation = "source-in";
  context.fillStyle = colour;
  context.fillRect(0, 0, canvas.width, canvas.height);
  known.set(colour, canvas);
  return canvas;
}

export class Viewer {
  readonly canvas = h("canvas", { className: "viewer", tabIndex: 0, role: "img" });
  tool: Tool | null = null;
  showMask = true;
  private zoom = 1;
  private offset = { x: 0, y: 0 };
  private panning: { x: number; y: number } | null = null;
  private size = { width: 0, height: 0 };
  private direction = 1;
  private lastFrame = 0;
  readonly redraw = coalesced(() => this.draw());
  private ends: (() => void)[] = [];

  constructor() {
    const observer = new ResizeObserver(([entry]) => {
      const box = entry!.contentRect;
      this.size = { width: box.width, height: box.height };
      this.canvas.width = Math.max(1, Math.round(box.width * devicePixelRatio));
      this.canvas.height = Math.max(1, Math.round(box.height * devicePixelRatio));
      this.draw();
    });
    observer.observe(this.canvas);
    this.ends.push(() => observer.disconnect());
    this.ends.push(store.on(["frame"], () => this.moved()));
    this.ends.push(store.on(["files", "view", "shot"], this.redraw));
    this.canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    this.canvas.addEventListener("pointerdown", (event) => this.pointerDown(event));
    this.canvas.addEventListener("pointermove", (event) => this.pointerMove(event));
    this.canvas.addEventListener("pointerup", (event) => this.pointerUp(event));
    this.canvas.addEventListener("pointercancel", (event) => this.pointerUp(event));
    this.moved();
  }

  end(): void {
    for (const act of this.ends) act();
  }

  fit(): void {
    this.zoom = 1;
    this.offset = { x: 0, y: 0 };
    this.redraw();
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

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    if (!event.ctrlKey && !event.metaKey) {
      store.setFrame(store.frame + Math.sign(event.deltaY || event.deltaX));
      return;
    }
    const [x, y] = this.at(event);
    const before = this.place();
    this.zoom = Math.min(16, Math.max(1, this.zoom * Math.exp(-event.deltaY / 300)));
    const after = this.place();
    this.offset.x += x * (before.scale - after.scale) + before.x - after.x;
    this.offset.y += y * (before.scale - after.scale) + before.y - after.y;
    if (this.zoom === 1) this.offset = { x: 0, y: 0 };
    this.redraw();
  }

  private pointerDown(event: PointerEvent): void {
    this.canvas.setPointerCapture(event.pointerId);
    if (event.button === 1 || (event.button === 0 && event.altKey)) {
      this.panning = { x: event.clientX - this.offset.x, y: event.clientY - this.offset.y };
      event.preventDefault();
    } else if (event.button === 0) {
      this.tool?.down?.(...this.at(event), event);
    }
  }

  private pointerMove(event: PointerEvent): void {
    if (this.panning) {
      this.offset = { x: event.clientX - this.panning.x, y: event.clientY - this.panning.y };
      this.redraw();
    } else {
      // All positions of the pen since the last event, not only the newest.
      const all = event.getCoalescedEvents?.() ?? [];
      for (const each of all.length > 0 ? all : [event]) this.tool?.move?.(...this.at(each), each);
    }
  }

  private pointerUp(event: PointerEvent): void {
    if (this.panning) this.panning = null;
    else this.tool?.up?.(...this.at(event), event);
  }

  private draw(): void {
    if (!store.shot || this.size.width === 0) return;
    const { width, height, footage, frames: count } = store.shot;
    const context = this.canvas.getContext("2d")!;
    const { scale, x, y } = this.place();
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    const ratio = devicePixelRatio;
    context.setTransform(scale * ratio, 0, 0, scale * ratio, x * ratio, y * ratio);
    context.fillStyle = "#000";
    context.fillRect(0, 0, width, height);
    const shown = footage ? frames.picture(store.frame) : undefined;
    if (shown) context.drawImage(shown, 0, 0, width, height);
    if (store.view.dim > 0) {
      context.fillStyle = `rgba(0, 0, 0, ${store.view.dim})`;
      context.fillRect(0, 0, width, height);
    }
    if (this.showMask) this.drawMasks(context);
    this.tool?.paint(context, scale);
    this.canvas.style.cursor = this.tool?.cursor ?? "default";
    const what = shown || !footage ? "" : ", loading";
    this.canvas.setAttribute("aria-label", `Frame ${store.frame} of ${count}${what}`);
    this.canvas.dataset["frame"] = shown || !footage ? String(store.frame) : "";
  }

  private drawMasks(context: CanvasRenderingContext2D): void {
    const { width, height } = store.opened;
    const lay = (frame: number, colour: string, opacity: number) => {
      const mask = frames.mask(frame, this.redraw);
      if (!mask) return;
      context.globalAlpha = opacity;
      context.drawImage(coloured(mask, colour), 0, 0, width, height);
      context.globalAlpha = 1;
    };
    if (store.view.onion) {
      lay(store.frame - 1, "#ff5d5d", 0.25);
      lay(store.frame + 1, "#5da9ff", 0.25);
    }
    // Without footage the mask is all there is to see.
    const opacity = store.opened.footage ? store.view.maskOpacity : 1;
    if (opacity > 0) lay(store.frame, store.opened.footage ? "#ffb020" : "#fff", opacity);
  }
}
