// The steps of a drawing, any number of them: what a step covered is kept packed, which for strokes
// and masks is a few hundred bytes.

/** A part of a picture, packed: runs of equal pixels as (length, pixel) pairs. */
export interface Patch {
  x: number;
  y: number;
  width: number;
  height: number;
  runs: Uint32Array;
}

/** Packs a part of a picture that lies at (x, y). */
export function packed(part: ImageData, x: number, y: number): Patch {
  const pixels = new Uint32Array(part.data.buffer, part.data.byteOffset, part.data.length / 4);
  const runs: number[] = [];
  for (let at = 0; at < pixels.length; ) {
    const pixel = pixels[at]!;
    let end = at + 1;
    while (end < pixels.length && pixels[end] === pixel) end++;
    runs.push(end - at, pixel);
    at = end;
  }
  return { x, y, width: part.width, height: part.height, runs: Uint32Array.from(runs) };
}

/** The pixels of a patch. */
export function unpacked({ width, height, runs }: Patch): ImageData {
  const part = new ImageData(width, height);
  const pixels = new Uint32Array(part.data.buffer);
  let at = 0;
  for (let run = 0; run < runs.length; run += 2) {
    const end = at + runs[run]!;
    pixels.fill(runs[run + 1]!, at, end);
    at = end;
  }
  return part;
}

/** What can be undone and done again. */
export class History {
  private done: Patch[] = [];
  private undone: Patch[] = [];

  get canUndo(): boolean {
    return this.done.length > 0;
  }

  get canRedo(): boolean {
    return this.undone.length > 0;
  }

  /** Notes what a new step covers. */
  add(before: Patch): void {
    this.done.push(before);
    this.undone = [];
  }

  /** Takes the last step back (`back`), or does the last one undone again; false when there is none. */
  step(back: boolean, context: CanvasRenderingContext2D): boolean {
    const [from, to] = back ? [this.done, this.undone] : [this.undone, this.done];
    const patch = from.pop();
    if (!patch) return false;
    const { x, y, width, height } = patch;
    to.push(packed(context.getImageData(x, y, width, height), x, y));
    context.putImageData(unpacked(patch), x, y);
    return true;
  }
}
