// Pictures of the footage, fetched ahead of where the user scrubs, and masks and strokes.

import * as api from "./api";
import { h } from "./dom";
import { store } from "./store";

/** Most bytes of decoded pictures that are kept of each kind. */
const MOST_BYTES = 500e6;
const AT_ONCE = 4;

/** Frames fetched ahead and behind. */
const AHEAD = 48;
const BEHIND = 16;
const MASKS_AHEAD = 4;

/** The colour of the current frame's mask over the footage. */
export const MASK_COLOUR = "#ffb020";

/** Keeps pictures by a name; the longest unused go first. */
class Pictures {
  private kept = new Map<string, ImageBitmap>();
  private under = new Map<string, Promise<ImageBitmap | null>>();
  private bytes = 0;

  constructor(
    private readonly made: (blob: Blob, url: string) => Promise<ImageBitmap>,
    private readonly dropped: (old: ImageBitmap) => void = () => undefined,
  ) {}

  get(name: string): ImageBitmap | undefined {
    const found = this.kept.get(name);
    if (found) {
      this.kept.delete(name);
      this.kept.set(name, found);
    }
    return found;
  }

  has(name: string): boolean {
    return this.kept.has(name) || this.under.has(name);
  }

  /** What is at an address, kept by a name. */
  load(url: string, name = url): Promise<ImageBitmap | null> {
    const found = this.get(name);
    if (found) return Promise.resolve(found);
    let loading = this.under.get(name);
    if (!loading) {
      loading = this.fetch(url, name).finally(() => this.under.delete(name));
      this.under.set(name, loading);
    }
    return loading;
  }

  private async fetch(url: string, name: string): Promise<ImageBitmap | null> {
    const response = await fetch(url);
    if (!response.ok) return null;
    const picture = await this.made(await response.blob(), name);
    this.kept.set(name, picture);
    this.bytes += 4 * picture.width * picture.height;
    for (const [old, its] of this.kept) {
      if (this.bytes <= MOST_BYTES || old === name) break;
      this.kept.delete(old);
      this.bytes -= 4 * its.width * its.height;
      this.dropped(its);
    }
    return picture;
  }
}

const bitmaps = (made: (blob: Blob, name: string) => Promise<ImageBitmap>) => new Pictures(made, (old) => old.close());
const whole = (blob: Blob) => createImageBitmap(blob);
const footage = bitmaps(whole);
const masks = bitmaps(whole);
/** Frames at their full width, for looking closely. */
const details = bitmaps(whole);
/** Masks and strokes in one colour; their names begin with colour and width. */
const overlays = bitmaps(async (blob, name) => {
  const [colour, width] = name.split(" ");
  const picture = await createImageBitmap(blob, { resizeWidth: Number(width), resizeQuality: "low" });
  const pixels = coloured(picture, colour!);
  picture.close();
  return createImageBitmap(pixels);
});

/** White on black, or white on nothing, in one colour (#rrggbb), clear elsewhere. */
function coloured(picture: ImageBitmap, colour: string): ImageData {
  const canvas = h("canvas", { width: picture.width, height: picture.height });
  const context = canvas.getContext("2d", { willReadFrequently: true })!;
  context.drawImage(picture, 0, 0);
  const image = context.getImageData(0, 0, canvas.width, canvas.height);
  const pixels = new Uint32Array(image.data.buffer);
  const [red, green, blue] = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  const [shown] = new Uint32Array(Uint8Array.of(red!, green!, blue!, 255).buffer);
  for (let at = 0; at < pixels.length; at++) pixels[at] = image.data[4 * at]! >= 128 ? shown! : 0;
  return image;
}

let active = 0;
let wanted: number[] = [];

/** Width in pixels at which the footage is fetched: that of the screen at most. */
export function fetchedWidth(): number {
  const state = store.opened;
  return Math.min(state.width, Math.max(640, Math.ceil((screen.width * devicePixelRatio) / 320) * 320));
}

const url = (frame: number) => api.frameUrl(store.opened, frame, fetchedWidth());

export const picture = (frame: number) => footage.get(url(frame));

/** A frame at its full width; undefined while it is fetched. */
export function detail(frame: number, arrived: () => void): ImageBitmap | undefined {
  const address = api.frameUrl(store.opened, frame, store.opened.width);
  const found = details.get(address);
  if (!found && !details.has(address)) void details.load(address).then(arrived, () => undefined);
  return found;
}

/** A small picture for a sheet. */
export const smallPictureUrl = (frame: number, width: number) =>
  api.frameUrl(store.opened, frame, Math.min(width, store.opened.width));

/** Fetches the frames about the current one, the nearest first, more of them ahead than behind. */
export function prefetch(frame: number, direction: number, arrived: () => void): void {
  if (!store.shot?.footage) return;
  const last = store.shot.frames - 1;
  const ahead = direction < 0 ? -1 : 1;
  wanted = [frame];
  for (let d = 1; d <= AHEAD; d++) {
    wanted.push(frame + ahead * d);
    if (d <= BEHIND) wanted.push(frame - ahead * d);
  }
  wanted = wanted.filter((t) => t >= 0 && t <= last && !footage.has(url(t)));
  pump(arrived);
  for (let d = 1; d <= MASKS_AHEAD; d++) void overlay(maskName(frame + ahead * d), MASK_COLOUR, () => undefined);
}

function pump(arrived: () => void): void {
  while (active < AT_ONCE && wanted.length > 0 && store.shot) {
    const frame = wanted.shift()!;
    active++;
    footage
      .load(url(frame))
      .catch(() => null)
      .then(() => {
        active--;
        if (frame === store.frame) arrived();
        pump(arrived);
      });
  }
}

const numbered = (folder: string, frame: number) => `${folder}/${String(frame).padStart(6, "0")}.png`;
export const maskName = (frame: number) => numbered("masks", frame);
export const strokeName = (frame: number) => numbered("strokes", frame);

/** The mask of a frame, white on black; null when there is none or it is on its way. */
export function mask(frame: number, arrived: () => void): ImageBitmap | null {
  return file(masks, maskName(frame), arrived);
}

/** The mask of a frame, waited for; null when there is none. */
export function loadMask(frame: number): Promise<ImageBitmap | null> {
  const name = maskName(frame);
  const version = store.version(name);
  return version ? masks.load(api.fileUrl(store.opened.shot, name, version)) : Promise.resolve(null);
}

/**
 * A mask, or strokes, in one colour, of the width at which the footage is seen, or, `close`, of its own;
 * null when there are none or they are on their way.
 */
export function overlay(name: string, colour: string, arrived: () => void, close = false): ImageBitmap | null {
  const width = close ? store.opened.width : fetchedWidth();
  return file(overlays, name, arrived, `${colour} ${width} `);
}

function file(pictures: Pictures, name: string, arrived: () => void, prefix = ""): ImageBitmap | null {
  const version = store.version(name);
  if (!version) return null;
  const address = api.fileUrl(store.opened.shot, name, version);
  const known = prefix + address;
  const found = pictures.get(known);
  if (!found && !pictures.has(known)) void pictures.load(address, known).then(arrived, () => undefined);
  return found ?? null;
}
