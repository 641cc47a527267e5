// The rig's silhouette over the footage's: as high as the mask, about its middle, as the rig is looked at.

import { h } from "./dom";
import { mask } from "./frames";
import type { RigView } from "./rigview";
import { store } from "./store";
import type { Tool } from "./viewer";

/** Width at which outlines are looked for, pixels. */
const LOOK_AT = 240;

interface Box {
  x: number;
  y: number;
  width: number;
  height: number;
}

const probe = h("canvas", {});

/** The box of what is seen of a picture; `channel` 3 is its opacity, 0 its brightness. */
function seen(picture: CanvasImageSource, width: number, height: number, channel: number): Box | null {
  const scale = Math.min(1, LOOK_AT / width);
  probe.width = Math.max(1, Math.round(width * scale));
  probe.height = Math.max(1, Math.round(height * scale));
  const context = probe.getContext("2d", { willReadFrequently: true })!;
  context.drawImage(picture, 0, 0, probe.width, probe.height);
  const { data } = context.getImageData(0, 0, probe.width, probe.height);
  let [left, top, right, bottom] = [Infinity, Infinity, -1, -1];
  for (let at = 0; at < probe.width * probe.height; at++) {
    if (data[4 * at + channel]! < 128) continue;
    const [x, y] = [at % probe.width, Math.floor(at / probe.width)];
    [left, top] = [Math.min(left, x), Math.min(top, y)];
    [right, bottom] = [Math.max(right, x), Math.max(bottom, y)];
  }
  if (right < 0) return null;
  return { x: left / scale, y: top / scale, width: (right + 1 - left) / scale, height: (bottom + 1 - top) / scale };
}

/** Lays the rig over the picture. */
export class Ghost implements Tool {
  shown = false;

  constructor(private readonly rig: RigView) {}

  paint(context: CanvasRenderingContext2D): void {
    const own = this.shown ? mask(store.frame, () => undefined) : null;
    if (!own) return;
    this.rig.drawNow();
    const { canvas } = this.rig;
    const animal = seen(own, own.width, own.height, 0);
    const rig = seen(canvas, canvas.width, canvas.height, 3);
    if (!animal || !rig) return;
    const scale = animal.height / rig.height;
    const flat = h("canvas", { width: canvas.width, height: canvas.height });
    const paint = flat.getContext("2d")!;
    paint.drawImage(canvas, 0, 0);
    paint.globalCompositeOperation = "source-in";
    paint.fillStyle = "#38bdf8";
    paint.fillRect(0, 0, flat.width, flat.height);
    context.globalAlpha = 0.55;
    const x = animal.x + animal.width / 2 - (rig.x + rig.width / 2) * scale;
    context.drawImage(flat, x, animal.y - rig.y * scale, flat.width * scale, flat.height * scale);
    context.globalAlpha = 1;
  }
}
