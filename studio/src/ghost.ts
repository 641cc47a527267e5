// The rig's silhouette over the footage's: as the rig is looked at, about the mask's middle, at one
// scale for the whole clip, so that what differs from frame to frame is the motion.

import { h } from "./dom";
import { loadMask, mask } from "./frames";
import type { RigView } from "./rigview";
import { store } from "./store";
import type { Tool } from "./viewer";

/** Width at which outlines are looked for, pixels. */
const LOOK_AT = 320;

const COLOUR = "#38bdf8";

/** Middle and square root of the area of what is seen, pixels. */
interface Seen {
  x: number;
  y: number;
  size: number;
}

const probe = h("canvas", {});

/** What is seen of a picture; `channel` 3 is its opacity, 0 its brightness. */
function seen(picture: CanvasImageSource, width: number, height: number, channel: number): Seen | null {
  const scale = Math.min(1, LOOK_AT / width);
  probe.width = Math.max(1, Math.round(width * scale));
  probe.height = Math.max(1, Math.round(height * scale));
  const context = probe.getContext("2d", { willReadFrequently: true })!;
  context.drawImage(picture, 0, 0, probe.width, probe.height);
  const { data } = context.getImageData(0, 0, probe.width, probe.height);
  let [area, x, y] = [0, 0, 0];
  for (let at = 0; at < probe.width * probe.height; at++) {
    if (data[4 * at + channel]! < 128) continue;
    area++;
    x += at % probe.width;
    y += Math.floor(at / probe.width);
  }
  if (area === 0) return null;
  return { x: (x / area + 0.5) / scale, y: (y / area + 0.5) / scale, size: Math.sqrt(area) / scale };
}

/** Side of the square that outlines are compared in, and the share of it that their size is, pixels. */
const COMPARED = 96;
const COMPARED_SIZE = 0.35;

/** A picture's outline about its middle, brought to one size: 0 or 1 a pixel. */
function outline(picture: CanvasImageSource, about: Seen, channel: number): Uint8Array {
  probe.width = probe.height = COMPARED;
  const context = probe.getContext("2d", { willReadFrequently: true })!;
  const scale = (COMPARED_SIZE * COMPARED) / about.size;
  context.setTransform(scale, 0, 0, scale, COMPARED / 2 - about.x * scale, COMPARED / 2 - about.y * scale);
  context.drawImage(picture, 0, 0);
  const { data } = context.getImageData(0, 0, COMPARED, COMPARED);
  return Uint8Array.from({ length: COMPARED * COMPARED }, (_, at) => (data[4 * at + channel]! >= 128 ? 1 : 0));
}

/** Pixels in both outlines over pixels in either. */
function overlap(a: Uint8Array, b: Uint8Array): number {
  let [both, either] = [0, 0];
  a.forEach((own, at) => {
    both += own & b[at]!;
    either += own | b[at]!;
  });
  return either === 0 ? 0 : both / either;
}

const median = (values: number[]) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)] ?? 1;

/** Lays the rig over the picture. */
export class Ghost implements Tool {
  shown = false;
  /** Scale from the rig's picture to the footage, of each frame seen so far from where it is looked at. */
  private scales = new Map<number, number>();
  private view = "";

  constructor(
    private readonly rig: RigView,
    private readonly redraw: () => void,
  ) {
    rig.onTurn = () => this.shown && this.redraw();
  }

  /**
   * Looks at the rig from the side on which it is more like the masks of some frames; `pose` puts it
   * as it is at a frame.
   */
  async face(frames: number[], pose: (frame: number) => void): Promise<void> {
    const masks = await Promise.all(frames.map((frame) => loadMask(frame)));
    const likeness = (turn: number) => {
      this.rig.side(turn);
      return frames.reduce((sum, frame, at) => {
        pose(frame);
        this.rig.drawNow();
        const { canvas } = this.rig;
        const own = masks[at] ?? null;
        const animal = own && seen(own, own.width, own.height, 0);
        const rig = seen(canvas, canvas.width, canvas.height, 3);
        if (!own || !animal || !rig) return sum;
        return sum + overlap(outline(own, animal, 0), outline(canvas, rig, 3));
      }, 0);
    };
    const [one, other] = [likeness(0), likeness(Math.PI)];
    this.rig.side(other > one ? Math.PI : 0);
    pose(store.frame);
  }

  paint(context: CanvasRenderingContext2D): void {
    const own = this.shown ? mask(store.frame, this.redraw) : null;
    if (!own) return;
    this.rig.drawNow();
    const { canvas } = this.rig;
    const animal = seen(own, own.width, own.height, 0);
    const rig = seen(canvas, canvas.width, canvas.height, 3);
    if (!animal || !rig) return;
    if (this.view !== this.rig.viewpoint) this.scales.clear();
    this.view = this.rig.viewpoint;
    this.scales.set(store.frame, animal.size / rig.size);
    const scale = median([...this.scales.values()]);
    const flat = h("canvas", { width: canvas.width, height: canvas.height });
    const paint = flat.getContext("2d")!;
    paint.drawImage(canvas, 0, 0);
    paint.globalCompositeOperation = "source-in";
    paint.fillStyle = COLOUR;
    paint.fillRect(0, 0, flat.width, flat.height);
    context.globalAlpha = 0.55;
    context.drawImage(
      flat,
      animal.x - rig.x * scale,
      animal.y - rig.y * scale,
      flat.width * scale,
      flat.height * scale,
    );
    context.globalAlpha = 1;
  }
}
