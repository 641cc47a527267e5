// Pictures of the footage, fetched ahead of where the user scrubs, and masks.

import * as api from "./api";
import { store } from "./store";

/** Most bytes of decoded pictures that are kept. */
const MOST_BYTES = 500e6;
const AT_ONCE = 4;

/** Keeps pictures by a name, the longest unused go first. */
class Pictures {
  private kept = new Map<string, ImageBitmap>();
  private under = new Map<string, Promise<ImageBitmap | null>>();
  private bytes = 0;

  get(url: string): ImageBitmap | undefined {
    const found = this.kept.get(url);
    if (found) {
      this.kept.delete(url);
      this.kept.set(url, found);
    }
    return found;
  }

  has(url: string): boolean {
    return this.kept.has(url) || this.under.has(url);
  }

  load(url: string): Promise<ImageBitmap | null> {
    const found = this.get(url);
    if (found) return Promise.resolve(found);
    let loading = this.under.get(url);
    if (!loading) {
      loading = this.fetch(url).finally(() => this.under.delete(url));
      this.under.set(url, loading);
    }
    return loading;
  }

  private async fetch(url: string): Promise<ImageBitmap | null> {
    const response = await fetch(url);
    if (!response.ok) return null;
    const picture = await createImageBitmap(await response.blob());
    this.kept.set(url, picture);
    this.bytes += 4 * picture.width * picture.height;
    for (const [name, old] of this.kept) {
      if (this.bytes <= MOST_BYTES || name === url) break;
      this.kept.delete(name);
      this.bytes -= 4 * old.width * old.height;
      old.close();
    }
    return picture;
  }
}

const footage = new Pictures();
const masks = new Pictures();
let active = 0;
let wanted: number[] = [];

/** Width in pixels at which the footage is fetched: that of the screen at most. */
export function fetchedWidth(): number {
  const state = store.opened;
  return Math.min(state.width, Math.max(640, Math.ceil((screen.width * devicePixelRatio) / 320) * 320));
}

const url = (frame: number) => api.frameUrl(store.opened, frame, fetchedWidth());

export const picture = (frame: number) => footage.get(url(frame));

export const loadPicture = (frame: number) => footage.load(url(frame));

/** A small picture for a sheet. */
export const smallPictureUrl = (frame: number, width: number) =>
  api.frameUrl(store.opened, frame, Math.min(width, store.opened.width));

/** Fetches the frames about the current one, the nearest first, more of them ahead than behind. */
export function prefetch(frame: number, direction: number, arrived: () => void): void {
  if (!store.shot?.footage) return;
  const last = store.shot.frames - 1;
  const ahead = direction < 0 ? -1 : 1;
  wanted = [frame];
  for (let d = 1; d <= 48; d++) {
    wanted.push(frame + ahead * d);
    if (d <= 16) wanted.push(frame - ahead * d);
  }
  wanted = wanted.filter((t) => t >= 0 && t <= last && !footage.has(url(t)));
  pump(arrived);
}

function pump(arrived: () => void): void {
  while (active < AT_ONCE && wanted.length > 0) {
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

export const maskName = (frame: number) => `masks/${String(frame).padStart(6, "0")}.png`;
export const strokeName = (frame: number) => `strokes/${String(frame).padStart(6, "0")}.png`;

/** The mask of a frame, white on black; undefined while it is fetched, null when there is none. */
export function mask(frame: number, arrived: () => void): ImageBitmap | null | undefined {
  const name = maskName(frame);
  const version = store.version(name);
  if (!version) return null;
  const address = api.fileUrl(store.opened.shot, name, version);
  const found = masks.get(address);
  if (!found && !masks.has(address)) void masks.load(address).then(arrived, () => undefined);
  return found;
}
