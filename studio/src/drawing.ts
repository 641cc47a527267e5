// One frame's strokes or mask as a picture to draw on, with every step undoable, saved as it goes.

import * as api from "./api";
import { h } from "./dom";
import { complain, say } from "./say";
import { store } from "./store";

const SAVE_AFTER_MS = 400;

interface Patch {
  x: number;
  y: number;
  before: ImageData;
}

export class Drawing {
  readonly canvas: HTMLCanvasElement;
  private readonly context: CanvasRenderingContext2D;
  private done: Patch[] = [];
  private undone: Patch[] = [];
  private version: string;
  private timer: number | undefined;
  private saving: Promise<void> = Promise.resolve();
  private changed = false;
  readonly ready: Promise<void>;

  /** `opaque`: a mask, which has no unsaid pixels. */
  constructor(
    readonly name: string,
    private readonly opaque: boolean,
    private readonly redraw: () => void,
  ) {
    const { width, height } = store.opened;
    this.canvas = h("canvas", { width, height });
    this.context = this.canvas.getContext("2d", { willReadFrequently: true })!;
    this.version = store.version(name);
    this.ready = this.load();
  }

  private async load(): Promise<void> {
    const { width, height } = this.canvas;
    this.context.clearRect(0, 0, width, height);
    if (this.opaque) {
      this.context.fillStyle = "#000";
      this.context.fillRect(0, 0, width, height);
    }
    if (this.version) {
      const url = api.fileUrl(store.opened.shot, this.name, this.version);
      const picture = await createImageBitmap(new Blob([await api.bytes(url)]));
      this.context.drawImage(picture, 0, 0);
      picture.close();
    }
    this.redraw();
  }

  /** Whether nothing is drawn. */
  private isEmpty(): boolean {
    const { data } = this.context.getImageData(0, 0, this.canvas.width, this.canvas.height);
    for (let at = 3; at < data.length; at += 4) if (data[at] !== 0) return false;
    return true;
  }

  /** Changes the part within a box, undoably. */
  edit(box: [number, number, number, number], act: (context: CanvasRenderingContext2D) => void): void {
    const { width, height } = this.canvas;
    const x = Math.max(0, Math.floor(box[0]));
    const y = Math.max(0, Math.floor(box[1]));
    const right = Math.min(width, Math.ceil(box[2]));
    const bottom = Math.min(height, Math.ceil(box[3]));
    if (right <= x || bottom <= y) return;
    this.done.push({ x, y, before: this.context.getImageData(x, y, right - x, bottom - y) });
    this.undone = [];
    act(this.context);
    this.touched();
  }

  /** Draws without a step of its own: what `begin` has noted is undone with it. */
  begin(): void {
    const { width, height } = this.canvas;
    this.done.push({ x: 0, y: 0, before: this.context.getImageData(0, 0, width, height) });
    this.undone = [];
  }

  draw(act: (context: CanvasRenderingContext2D) => void): void {
    act(this.context);
    this.redraw();
  }

  /** Ends what `begin` began; only the box that changed is kept for undoing. */
  finish(box: [number, number, number, number]): void {
    const whole = this.done.pop();
    if (!whole) return;
    const x = Math.max(0, Math.floor(box[0]));
    const y = Math.max(0, Math.floor(box[1]));
    const width = Math.min(this.canvas.width, Math.ceil(box[2])) - x;
    const height = Math.min(this.canvas.height, Math.ceil(box[3])) - y;
    if (width <= 0 || height <= 0) return;
    const part = new ImageData(width, height);
    for (let row = 0; row < height; row++) {
      const from = 4 * ((y + row) * whole.before.width + x);
      part.data.set(whole.before.data.subarray(from, from + 4 * width), 4 * row * width);
    }
    this.done.push({ x, y, before: part });
    this.touched();
  }

  undo(): void {
    this.swap(this.done, this.undone);
  }

  redo(): void {
    this.swap(this.undone, this.done);
  }

  private swap(from: Patch[], to: Patch[]): void {
    const patch = from.pop();
    if (!patch) return;
    const { x, y, before } = patch;
    to.push({ x, y, before: this.context.getImageData(x, y, before.width, before.height) });
    this.context.putImageData(before, x, y);
    this.touched();
  }

  private touched(): void {
    this.changed = true;
    this.redraw();
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => void this.save(), SAVE_AFTER_MS);
  }

  /** Writes what is drawn to the shot; waits until it is there. */
  save(): Promise<void> {
    clearTimeout(this.timer);
    this.saving = this.saving.then(() => this.store()).catch(complain);
    return this.saving;
  }

  private async store(): Promise<void> {
    if (!this.changed) return;
    this.changed = false;
    const { shot } = store.opened;
    try {
      if (!this.opaque && this.isEmpty()) {
        if (this.version) await api.deleteFile(shot, this.name, this.version);
        this.version = "";
      } else {
        const blob = await new Promise<Blob | null>((done) => this.canvas.toBlob(done, "image/png"));
        if (blob) this.version = await api.putFile(shot, this.name, blob, this.version);
      }
      store.wrote(this.name, this.version);
    } catch (error) {
      if (!(error instanceof api.Refused && error.status === 409 && error.version !== null)) {
        this.changed = true;
        throw error;
      }
      const { width, height } = this.canvas;
      this.done.push({ x: 0, y: 0, before: this.context.getImageData(0, 0, width, height) });
      this.version = error.version;
      store.wrote(this.name, this.version);
      await this.load();
      say(`${this.name} was changed elsewhere meanwhile and is shown as it is now.`, "Undo brings back what you drew.");
    }
  }
}
