// One frame's strokes or mask as a picture to draw on, saved as it goes.

import * as api from "./api";
import { h } from "./dom";
import { History, packed, type Patch } from "./history";
import { complain, say } from "./say";
import { store } from "./store";

/** A stroke is saved when the pen has rested this long. */
const SAVE_AFTER_MS = 150;

/** What could not be saved, because a job works on the shot or the program is away, is tried again. */
const TRY_AGAIN_MS = 1500;

/** No program, one that does not know this page yet, or one with a job on the shot. */
const PASSING = [0, 401, 423];

/** Steps outlive a frame being left, as long as nobody else changes its file. */
const histories = new Map<string, { version: string; history: History }>();

/** Drawings with something that is not in the shot yet. */
const unsaved = new Map<string, Drawing>();

/** Left, top, right and bottom, pixels. */
export type Box = [number, number, number, number];

export class Drawing {
  readonly canvas: HTMLCanvasElement;
  private readonly context: CanvasRenderingContext2D;
  private readonly key: string;
  private history: History;
  private version: string;
  private timer: number | undefined;
  private saving: Promise<void> = Promise.resolve();
  private changed = false;
  private complained = false;
  private before: ImageData | null = null;
  /** Strokes that were drawn while the picture was on its way. */
  private early: (() => void)[] | null = [];
  readonly ready: Promise<void>;

  private constructor(
    private readonly shot: string,
    readonly name: string,
    private readonly opaque: boolean,
    private redraw: () => void,
  ) {
    const { width, height } = store.opened;
    this.canvas = h("canvas", { width, height });
    this.context = this.canvas.getContext("2d", { willReadFrequently: true })!;
    this.version = store.version(name);
    this.key = `${shot}\n${name}`;
    const known = histories.get(this.key);
    this.history = known?.version === this.version ? known.history : new History();
    this.ready = this.load().catch(complain);
  }

  /** The drawing of a file; `opaque`: a mask, which has no unsaid pixels. */
  static open(name: string, opaque: boolean, redraw: () => void): Drawing {
    const { shot } = store.opened;
    const kept = unsaved.get(`${shot}\n${name}`);
    if (!kept) return new Drawing(shot, name, opaque, redraw);
    // Unsaved as it is, it goes on from there.
    kept.redraw = redraw;
    return kept;
  }

  get canUndo(): boolean {
    return this.history.canUndo;
  }

  get canRedo(): boolean {
    return this.history.canRedo;
  }

  /** Whether there is anything of it, in the shot or on its way there. */
  get exists(): boolean {
    return this.version !== "" || this.changed;
  }

  /** Whether the shot holds something else than this has loaded or written. */
  get outdated(): boolean {
    return !this.changed && !unsaved.has(this.key) && this.version !== store.version(this.name);
  }

  private async load(): Promise<void> {
    let picture: ImageBitmap | null = null;
    if (this.version) {
      const url = api.fileUrl(this.shot, this.name, this.version);
      picture = await createImageBitmap(new Blob([await api.bytes(url)]));
    }
    this.clear();
    if (picture) this.context.drawImage(picture, 0, 0);
    picture?.close();
    const early = this.early ?? [];
    this.early = null;
    for (const act of early) act();
    this.redraw();
  }

  /** Takes everything away, without a step. */
  private clear(): void {
    const { width, height } = this.canvas;
    this.context.clearRect(0, 0, width, height);
    if (!this.opaque) return;
    this.context.fillStyle = "#000";
    this.context.fillRect(0, 0, width, height);
  }

  private whenLoaded(act: () => void): void {
    if (this.early) this.early.push(act);
    else act();
  }

  private isEmpty(): boolean {
    const { data } = this.context.getImageData(0, 0, this.canvas.width, this.canvas.height);
    return new Uint32Array(data.buffer).every((pixel) => pixel === 0);
  }

  /** Begins a step; what is drawn up to `finish` is undone together. */
  begin(): void {
    this.whenLoaded(() => {
      this.before = this.context.getImageData(0, 0, this.canvas.width, this.canvas.height);
    });
  }

  draw(act: (context: CanvasRenderingContext2D) => void): void {
    this.whenLoaded(() => {
      act(this.context);
      this.redraw();
    });
  }

  /** Ends the step; nothing outside the box has changed. */
  finish(box: Box): void {
    this.whenLoaded(() => {
      const step = this.before && part(this.before, box);
      this.before = null;
      if (!step) return;
      this.history.add(step);
      this.touched();
    });
  }

  /** A step that may change everything. */
  edit(act: (context: CanvasRenderingContext2D) => void): void {
    this.begin();
    this.draw(act);
    this.finish([0, 0, this.canvas.width, this.canvas.height]);
  }

  /** Empties the picture as a step. */
  wipe(): void {
    this.edit(() => this.clear());
  }

  undo(): void {
    this.whenLoaded(() => this.history.step(true, this.context) && this.touched());
  }

  redo(): void {
    this.whenLoaded(() => this.history.step(false, this.context) && this.touched());
  }

  private touched(): void {
    this.changed = true;
    unsaved.set(this.key, this);
    this.redraw();
    this.later(SAVE_AFTER_MS);
  }

  private later(wait: number): void {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => void this.save(), wait);
  }

  /** Writes what is drawn to the shot; waits until it is there. */
  save(): Promise<void> {
    clearTimeout(this.timer);
    this.saving = this.saving.then(() => this.store()).catch((error: unknown) => this.postpone(error));
    return this.saving;
  }

  private async store(): Promise<void> {
    if (!this.changed) return;
    this.changed = false;
    try {
      if (!this.opaque && this.isEmpty()) {
        if (this.version) await api.deleteFile(this.shot, this.name, this.version);
        this.version = "";
      } else {
        const blob = await new Promise<Blob | null>((done) => this.canvas.toBlob(done, "image/png"));
        if (blob) this.version = await api.putFile(this.shot, this.name, blob, this.version);
      }
      this.stored();
    } catch (error) {
      if (!(error instanceof api.Refused && error.status === 409 && error.version !== null)) throw error;
      await this.takeTheirs(error.version);
    }
  }

  private stored(): void {
    this.complained = false;
    histories.set(this.key, { version: this.version, history: this.history });
    if (!this.changed) unsaved.delete(this.key);
    if (store.shot?.shot === this.shot) store.wrote(this.name, this.version);
  }

  /** The file was changed elsewhere: what is there now is shown, and what was drawn is a step back. */
  private async takeTheirs(version: string): Promise<void> {
    const { width, height } = this.canvas;
    const own = packed(this.context.getImageData(0, 0, width, height), 0, 0);
    this.version = version;
    this.early = [];
    await this.load();
    this.history = new History();
    this.history.add(own);
    this.stored();
    say(
      `${this.name} was changed elsewhere meanwhile and is shown as it is now.`,
      "Undo brings back what you drew here.",
    );
  }

  private postpone(error: unknown): void {
    this.changed = true;
    const passes = error instanceof api.Refused && PASSING.includes(error.status);
    // A job that ends by itself is nothing to complain of.
    const waits = error instanceof api.Refused && error.status === 423;
    if (!this.complained && !waits) complain(error);
    this.complained = true;
    // What is refused for good is tried again with the next stroke.
    if (passes) this.later(TRY_AGAIN_MS);
  }
}

/** The part of a picture within a box; null when there is none. */
function part(whole: ImageData, box: Box): Patch | null {
  const [x, y] = [Math.max(0, Math.floor(box[0])), Math.max(0, Math.floor(box[1]))];
  const width = Math.min(whole.width, Math.ceil(box[2])) - x;
  const height = Math.min(whole.height, Math.ceil(box[3])) - y;
  if (!(width > 0 && height > 0)) return null;
  const cut = new ImageData(width, height);
  for (let row = 0; row < height; row++) {
    const from = 4 * ((y + row) * whole.width + x);
    cut.data.set(whole.data.subarray(from, from + 4 * width), 4 * row * width);
  }
  return packed(cut, x, y);
}

/** Saves everything that is drawn and not saved yet. */
export async function saveAll(): Promise<void> {
  await Promise.all([...unsaved.values()].map((drawing) => drawing.save()));
}

// A tab that is closed or put away saves first; one that cannot asks before it closes.
addEventListener("pagehide", () => void saveAll());
document.addEventListener("visibilitychange", () => {
  if (document.visibilityState === "hidden") void saveAll();
});
addEventListener("beforeunload", (event) => {
  if (unsaved.size === 0) return;
  void saveAll();
  event.preventDefault();
});
